//! What is said of each condition that the climate found.

use super::{
    elevation, AerosolClimate, AerosolMixture, AtmosphereBlend, Condition, Elevation, Ground,
    Overrides, CLIMATE,
};
use crate::error::Result;
use crate::place::{Instant, Site};

pub(super) const OPAC_SOURCE: &str = "OPAC, Hess, Koepke & Schult 1998";
pub(super) const GADS_SOURCE: &str = "GADS, Koepke, Hess, Schult & Shettle 1997";

/// Altitude of the ground: the override, else the site's, else the map's.
pub(super) fn altitude(given_m: Option<f64>, site: &Site) -> Result<Condition<f64>> {
    let given_m = given_m.or((site.altitude_m() != 0.0).then_some(site.altitude_m()));
    if let Some(metres) = given_m {
        return Ok(Condition::given(metres, "m"));
    }
    let Elevation {
        here_m, spread_m, ..
    } = elevation(site.latitude_deg(), site.longitude_deg())?;
    let source = "Mapzen terrain tiles, half-degree means";
    let reason = "none was given: mean elevation of the surroundings, 0 at sea";
    Ok(Condition::new(here_m, "m", source, reason).with_uncertainty(spread_m))
}

/// A coordinate of a place: of the city that it was named by, or given.
pub(super) fn coordinate(value: f64, site: &Site) -> Condition<f64> {
    match site.city() {
        Some(city) => {
            let reason = format!("of {}, {}", city.name, city.country);
            Condition::new(value, "deg", "GeoNames, www.geonames.org", reason)
        }
        None => Condition::given(value, "deg"),
    }
}

/// What the position of the sun comes from.
pub(super) fn spa(value: f64, unit: &'static str) -> Condition<f64> {
    let source = "NREL SPA, Reda & Andreas 2004, doi:10.1016/j.solener.2003.12.003";
    let reason = "from place and time; true, not refracted";
    Condition::new(value, unit, source, reason)
}

pub(super) fn ozone(
    overrides: &Overrides,
    latitude_deg: f64,
    longitude_deg: f64,
    instant: &Instant,
) -> Result<Condition<f64>> {
    let climate = overrides.ozone_climate.unwrap_or_default();
    let column = climate.column(latitude_deg, longitude_deg, instant)?;
    let mut ozone = Condition::new(column.du, "DU", column.source, column.reason);
    ozone.uncertainty = column.deviation_du;
    Ok(ozone)
}

/// A latitude in words: `41.7° N`, `90.0° S`.
pub(super) fn degrees_north(latitude_deg: f64) -> String {
    let side = if latitude_deg < 0.0 { 'S' } else { 'N' };
    format!("{:.1}° {side}", latitude_deg.abs())
}

fn percent(share: f64) -> f64 {
    (100.0 * share).round()
}

pub(super) fn atmosphere_words(blend: &AtmosphereBlend, latitude_deg: f64) -> Condition<String> {
    let parts: Vec<String> = blend
        .iter()
        .filter(|(_, weight)| *weight >= 0.005)
        .map(|(class, weight)| format!("{} {} %", class.name(), percent(*weight)))
        .collect();
    Condition::new(
        CLIMATE.to_owned(),
        "",
        "AFGL 1986, Anderson et al., AFGL-TR-86-0110; ozone layer of CAM3's climatology",
        format!(
            "blended for {} and the season: {}",
            degrees_north(latitude_deg),
            parts.join(", ")
        ),
    )
}

pub(super) fn aerosol_words(mixture: &AerosolMixture) -> Condition<String> {
    let [mineral, salt, soot, rest] = mixture.share.map(percent);
    let urban = match percent(mixture.urban) {
        0.0 => String::new(),
        share => format!("; {share} % of the mixing layer is of cities near by"),
    };
    let reason = format!(
        "nearest AIAA type: {}; of the optical depth at 550 nm {mineral} % is mineral dust, {salt} % sea salt, {soot} % \
         soot, {rest} % sulphate and other{urban}",
        mixture.nearest_type
    );
    let source = format!("{GADS_SOURCE}, in components of {OPAC_SOURCE}");
    Condition::new(CLIMATE.to_owned(), "", source, reason)
}

pub(super) fn aod_words(found: &AerosolClimate) -> Condition<f64> {
    let reason = format!(
        "usual here at this time of this year: fitted from {:.3} of the data set and {:.3} of human making, cut at the \
         ground's altitude; {:.3} of the stratosphere comes on top",
        found.gads_aod_550, found.anthropogenic_aod_550, found.stratospheric_aod_550
    );
    let source = "GADS and MACv2-SP, Stevens et al. 2017, doi:10.5194/gmd-10-433-2017, fitted to a reanalysis";
    Condition::new(found.aod_550, "", source, reason).with_uncertainty(found.aod_550_uncertainty)
}

pub(super) fn albedo_words(ground: Option<&Ground>) -> Condition<f64> {
    let (value, words) = ground.map_or((0.2, String::new()), |g| (g.broadband(), g.words()));
    let source = "MODIS MCD12C1 land cover, snow and sea ice by month; measured spectra";
    let reason = format!("broadband mean of the surroundings: {words}; spectral in use");
    Condition::new(value, "", source, reason).with_uncertainty(0.05)
}
