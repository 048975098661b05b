use super::*;

fn at(lat: f64, lon: f64, altitude_m: f64, time: &str) -> AerosolClimate {
    aerosol_climate(lat, lon, altitude_m, &time.parse().unwrap()).unwrap()
}

/// Regional means of GADS with OPAC's optics that an independent sum over the grid gave: Sahara .32/.33, North Atlantic
/// .20/.10, Antarctica .074/.038 (winter/summer).
#[test]
fn regional_means_of_the_data_set() {
    let mean =
        |lats: std::ops::RangeInclusive<i32>, lons: std::ops::RangeInclusive<i32>, time: &str| {
            let (mut sum, mut n) = (0.0, 0.0);
            for lat in lats.step_by(5) {
                for lon in lons.clone().step_by(5) {
                    sum += at(f64::from(lat), f64::from(lon), 0.0, time).gads_aod_550;
                    n += 1.0;
                }
            }
            sum / n
        };
    let (winter, summer) = ("2021-01-16T12:00Z", "2021-07-16T12:00Z");
    for (name, lats, lons, expected) in [
        ("Sahara", 20..=30, -5..=25, [0.32, 0.33]),
        ("Antarctica", -90..=-80, -180..=175, [0.074, 0.038]),
    ] {
        for (time, expected) in [winter, summer].into_iter().zip(expected) {
            let got = mean(lats.clone(), lons.clone(), time);
            assert!((got / expected - 1.0).abs() < 0.15, "{name} {time}: {got}");
        }
    }
}

#[test]
fn each_kind_of_place_has_its_type() {
    let july = "2021-07-16T12:00Z";
    for (name, lat, lon, altitude_m, expected) in [
        ("mid-Pacific", 0.0, -150.0, 0.0, "maritime-clean"),
        ("Sahara", 23.0, 10.0, 500.0, "desert"),
        ("South Pole", -90.0, 0.0, 2835.0, "antarctic"),
        ("Mauna Loa", 19.54, -155.58, 3397.0, "background"),
        ("Beijing", 39.98, 116.38, 92.0, "urban"),
        ("Arctic Ocean", 85.0, 0.0, 0.0, "arctic"),
        ("Southern Ocean by the ice", -64.0, 80.0, 0.0, "antarctic"),
        ("Southern Ocean", -50.0, 80.0, 0.0, "maritime-clean"),
    ] {
        let found = at(lat, lon, altitude_m, july);
        let (mixture, share) = (&found.mixture, found.mixture.share);
        assert_eq!(
            mixture.nearest_type, expected,
            "{name}: {share:?} {}",
            mixture.urban
        );
        assert!((share.iter().sum::<f64>() - 1.0).abs() < 1e-12);
    }
}

/// At a pole the longitude does not matter, and 180° is −180°.
#[test]
fn one_place_has_one_aerosol() {
    let time = "2021-04-01T00:00Z";
    for (lat, lon) in [(90.0, 77.0), (-90.0, -123.0)] {
        let (a, b) = (at(lat, lon, 0.0, time), at(lat, 0.0, 0.0, time));
        assert!((a.gads_aod_550 - b.gads_aod_550).abs() < 1e-9);
    }
    assert_eq!(at(10.0, 180.0, 0.0, time), at(10.0, -180.0, 0.0, time));
}

#[test]
fn high_places_stand_above_part_of_it() {
    let july = "2021-07-16T12:00Z";
    let (foot, top) = (
        at(19.54, -155.58, 0.0, july),
        at(19.54, -155.58, 3397.0, july),
    );
    assert!(
        top.aod_550 < 0.4 * foot.aod_550,
        "{} {}",
        top.aod_550,
        foot.aod_550
    );
    // A high plain carries its own mixing layer.
    let lhasa = at(29.65, 91.1, 4500.0, july);
    assert!(lhasa.aod_550 > 0.05, "{}", lhasa.aod_550);
}

/// High plains are clean, although the plumes of China and India lie across them on the map: sun photometers have 0.12 at Lhasa and
/// 0.09 at Haibei (Wang et al. 2006, Environmental Science 27, 1703; August to December 2004 at 500 nm), and about 0.05 higher up.
#[test]
fn high_plains_are_clean() {
    for (name, lat, lon, altitude_m, measured) in [
        ("Lhasa", 29.67, 91.33, 3688.0, 0.12),
        ("Haibei", 37.62, 101.32, 3220.0, 0.09),
        ("Nam Co", 30.77, 90.96, 4746.0, 0.05),
    ] {
        let months = 8..=12;
        let count = months.clone().count() as f64;
        let month = |m: i32| {
            let found = at(lat, lon, altitude_m, &format!("2004-{m:02}-16T00:00Z"));
            found.aod_550 + found.stratospheric_aod_550
        };
        let mean = months.map(month).sum::<f64>() / count;
        println!("{name}: {mean:.3}, measured {measured}");
        assert!((mean - measured).abs() < 0.05, "{name}: {mean}");
    }
}
