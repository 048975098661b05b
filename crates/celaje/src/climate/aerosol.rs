//! The aerosol of every place: what it is made of, how it lies, and how much there is.
//!
//! Composition, layers and humidity are of the Global Aerosol Data Set (GADS: 5°, two seasons), bilinear in place and a
//! cosine through the year. The amount follows a fit of GADS and of anthropogenic plumes by year (MACv2-SP) to a modern
//! reanalysis. Layers stand on the mean ground of the region, so that a mountain reaches out of them and a high plain does
//! not.

use std::sync::OnceLock;

use super::blend::{cached, damaged, july_weight, smoothstep, GlobeGrid};
use super::elevation::elevation;
use super::ground::Ground;
use super::mixture::{AerosolMixture, MixtureComponent, MixtureLayer, COMPONENTS};
use super::plumes::anthropogenic_aod_550;
use crate::error::Result;
use crate::math::Table;
use crate::place::{gazetteer, Instant};

const GRID: GlobeGrid = GlobeGrid {
    step_deg: 5.0,
    first_latitude_deg: -90.0,
    direction: 1.0,
    first_longitude_deg: -180.0,
    rows: 37,
    columns: 72,
};

/// Layers of the mixing air: name, top above the ground \[m\], scale height \[m\].
///
/// Source: profiles of GADS, Koepke et al. 1997; Hess, Koepke & Schult 1998, table 5.
const SHAPES: [(&str, f64, Option<f64>); 5] = [
    ("arctic", 2e3, None),
    ("antarctic", 10e3, Some(8e3)),
    ("continental", 2e3, Some(8e3)),
    ("maritime", 2e3, Some(1e3)),
    ("desert", 6e3, Some(2e3)),
];
const CONTINENTAL: usize = 2;
/// By profile type of GADS less one: its mixing layer among [`SHAPES`], and where the free troposphere starts \[m\].
const PROFILES: [(usize, f64); 7] = [
    (0, 2e3),
    (1, 10e3),
    (2, 2e3),
    (3, 2e3),
    (3, 3.5e3),
    (4, 6e3),
    (2, 3.5e3),
];
/// The layer of transported mineral above the ground \[m\].
const MINERAL_M: [f64; 2] = [2e3, 3.5e3];
/// Free troposphere of OPAC: component, humidity \[%\], particles per cm³ at 2 km; scale height 8 km, up to 12 km.
const FREE: [(&str, f64, f64); 3] = [
    ("inso", 0.0, 0.097),
    ("waso", 50.0, 229.0),
    ("soot", 0.0, 228.0),
];
/// Top of the free troposphere \[m\].
const FREE_TOP_M: f64 = 12e3;
/// Stratosphere of OPAC: particles of dry `suso` per m³, and how thick it is \[m\]. Its column alone matters here, to what the data
/// set's and the fit's optical depths hold; its layer is composed by name.
const STRATOSPHERE: (f64, f64) = (3e6, 23e3);
/// Layers go on so far below the region's mean ground \[m\].
const BELOW_GROUND_M: f64 = 1e3;

/// Optical depth = 0.051 + 0.67 GADS + 0.80 MACv2-SP: least squares on a monthly 1° reanalysis, rms 0.070.
const FIT: [f64; 3] = [0.051, 0.67, 0.80];
const FIT_RMS: f64 = 0.070;
/// The fit's constant and its plumes lie low: scale height over the region's ground \[m\], the mean height of the nine
/// plumes of MACv2-SP (beta functions of z / 15 km).
const LOW_HEIGHT_M: f64 = 1.7e3;
/// Up to this altitude of the ground they stand on it; over higher plains, which their broad Gaussians run across as if they
/// were not there (0.3 over Tibet), they thin out with the same height \[m\].
const LOW_GROUND_M: f64 = 1.5e3;
/// Optical depth over the ice sheets, where the fit's constant is too much, and its spread.
///
/// Source: Six et al. 2005, Atmos. Environ. 39, 5041: 0.02 at 440 nm at Dome C in summer; Tomasi et al. 2015, Earth-Sci. Rev. 140.
const PLATEAU_AOD: [f64; 2] = [0.02, 0.01];

/// OPAC urban: waso, inso, soot, particles per cm³.
const URBAN_CM3: [f64; 3] = [28_000.0, 1.5, 130_000.0];
/// OPAC continental average: waso, inso, soot, particles per cm³; its single-scattering albedo is that of MACv2-SP's
/// industrial plumes, 0.93.
const HAZE_CM3: [f64; 3] = [7_000.0, 0.4, 8_300.0];
/// Largest share of urban aerosol in the mixing layer: no more, for it absorbs more (single-scattering albedo 0.82) than the air
/// of measured cities does (0.90 to 0.98, Dubovik et al. 2002, J. Atmos. Sci. 59, 590).
const URBAN_MOST: f64 = 0.25;
/// Distance over which a city's aerosol thins out \[km\], and people of a city at which it is near its full share.
const CITY_KM: f64 = 50.0;
const CITY_PEOPLE: f64 = 5e6;
/// Cities of fewer people are not looked at: GADS knows the regions in which they stand.
const CITY_LEAST: f64 = 3e5;

/// What was found for a place and an instant.
#[derive(Debug, Clone, PartialEq)]
pub struct AerosolClimate {
    /// Composition and layers.
    pub mixture: AerosolMixture,
    /// Tropospheric optical depth at 550 nm from the ground up \[1\].
    pub aod_550: f64,
    /// Its uncertainty as a month's mean, one standard deviation \[1\].
    pub aod_550_uncertainty: f64,
    /// Stratospheric optical depth at 550 nm \[1\].
    pub stratospheric_aod_550: f64,
    /// The data set's own optical depth before the fit \[1\].
    pub gads_aod_550: f64,
    /// Anthropogenic part by MACv2-SP before the fit \[1\].
    pub anthropogenic_aod_550: f64,
}

/// One node of the data set.
#[derive(Debug, Clone, Copy, Default)]
struct Node {
    /// Particles per cm³ at the ground by layer of [`SHAPES`] and component.
    number: [[f64; 10]; 5],
    /// Transported mineral, particles per cm³.
    mineral: f64,
    /// Relative humidity \[%\].
    humidity: f64,
    /// Where the free troposphere starts above the ground \[m\].
    free_from_m: f64,
    /// Optical depth at 550 nm over ground at sea level.
    aod: f64,
}

struct Gads {
    /// Season (winter, summer), latitude, longitude.
    nodes: Vec<Node>,
    extinction: Extinction,
}

/// Extinction of OPAC's components at 550 nm.
struct Extinction {
    /// By component: humidity classes \[%\] and extinction \[m² per particle\].
    classes: Vec<(Vec<f64>, Vec<f64>)>,
}

impl Extinction {
    /// m² per particle; linear in `h/(100 − h)`, with which volume grows.
    fn at(&self, component: usize, humidity_percent: f64) -> f64 {
        let (humidity, extinction) = &self.classes[component];
        let growth = |h: f64| h / (100.0 - h);
        let x: Vec<f64> = humidity.iter().map(|&h| growth(h)).collect();
        crate::math::interp::linear_clamped(&x, extinction, growth(humidity_percent.min(99.0)))
    }

    fn named(&self, id: &str, humidity_percent: f64) -> f64 {
        let component = COMPONENTS.iter().position(|c| *c == id);
        component.map_or(0.0, |c| self.at(c, humidity_percent))
    }

    /// Optical depth of a layer at 550 nm from an altitude upwards.
    fn layer(&self, layer: &MixtureLayer, humidity_percent: f64, altitude_m: f64) -> f64 {
        let one = |c: &MixtureComponent| {
            c.number_density * self.named(c.id, c.humidity_percent.unwrap_or(humidity_percent))
        };
        layer.components.iter().map(one).sum::<f64>() * layer.column_above(altitude_m)
    }

    /// Optical depth of the stratosphere at 550 nm, the same above any ground.
    fn stratosphere(&self) -> f64 {
        let (number_density, thickness_m) = STRATOSPHERE;
        number_density * self.named("suso", 0.0) * thickness_m
    }
}

/// The aerosol of a place whose ground lies at `altitude_m`.
///
/// `latitude_deg` −90 to 90, any `longitude_deg`; `altitude_m` above sea level, −500 to 9000.
///
/// # Errors
/// [`crate::Error::Invalid`] if an embedded table is damaged.
///
/// # Source
/// Koepke, Hess, Schult & Shettle 1997, Global Aerosol Data Set, MPI für Meteorologie report 243; Hess, Koepke & Schult
/// 1998, OPAC; Stevens et al. 2017, MACv2-SP, doi:10.5194/gmd-10-433-2017.
pub fn aerosol_climate(
    latitude_deg: f64,
    longitude_deg: f64,
    altitude_m: f64,
    instant: &Instant,
) -> Result<AerosolClimate> {
    let gads = gads()?;
    let mut node = gads.at(latitude_deg, longitude_deg, instant);
    let gads_aod_550 = node.aod;
    let anthropogenic_aod_550 = anthropogenic_aod_550(latitude_deg, longitude_deg, instant)?;
    let region_m = elevation(latitude_deg, longitude_deg)?.region_m;
    // Into a valley the layers come down.
    let base_m = region_m.min(altitude_m).round();
    let lowland = (-(base_m - LOW_GROUND_M).max(0.0) / LOW_HEIGHT_M).exp();
    let constant = lowland * FIT[0];
    let plumes = lowland * FIT[2] * anthropogenic_aod_550;
    // The fit's constant multiplies what the data set has; the plumes bring their own matter.
    let haze = plumes / (FIT[1] + constant / gads_aod_550);
    add_haze(&mut node, haze, &gads.extinction);
    let urban = urban_share(latitude_deg, longitude_deg)?;
    add_city(&mut node, urban, &gads.extinction);

    let mut mixture = layers(&node, base_m);
    mixture.urban = urban;

    // The fit's constant is of the sea and the inhabited land; the ice sheets are cleaner.
    let ice = Ground::at(latitude_deg, longitude_deg, instant)?.share[6];
    let not_south = 1.0 - smoothstep(60.0, 75.0, -latitude_deg);
    // In the south latitude says it all.
    let north = if latitude_deg > 0.0 { 1.0 } else { 0.0 };
    let not_high_ice = 1.0 - north * smoothstep(0.0, 1.0, ice) * smoothstep(0.0, 3000.0, region_m);
    let plateau = 1.0 - not_south * not_high_ice;
    let low = constant + plumes;
    let fitted = low + FIT[1] * gads_aod_550;
    let mixed = |fit: f64, clean: f64| fit + plateau * (clean - fit);
    let regional = mixed(fitted, PLATEAU_AOD[0]);

    let humidity = mixture.humidity_percent;
    let above = |from_m: f64| -> f64 {
        let depth = |l| gads.extinction.layer(l, humidity, from_m);
        mixture.layers.iter().map(depth).sum()
    };
    let stratospheric_aod_550 = gads.extinction.stratosphere();
    let whole = above(base_m);
    let left_of_layers = if whole > 0.0 {
        above(altitude_m) / whole
    } else {
        0.0
    };
    let left_of_low = (-(altitude_m - base_m) / LOW_HEIGHT_M).exp();
    let left = left_of_layers + low / fitted * (left_of_low - left_of_layers);
    let tropospheric = regional - stratospheric_aod_550;
    mixture.share = shares(&mixture, &gads.extinction, altitude_m);
    let of_poles = ["arctic", "antarctic"].map(|name| {
        let own = mixture.layers.iter().filter(|l| l.name == name);
        let depths = own.map(|l| gads.extinction.layer(l, humidity, altitude_m));
        depths.sum::<f64>() / above(altitude_m).max(f64::MIN_POSITIVE)
    });
    let above_region_m = altitude_m - region_m;
    mixture.nearest_type = nearest_type(&mixture, of_poles, latitude_deg, above_region_m);
    Ok(AerosolClimate {
        aod_550: tropospheric * left,
        aod_550_uncertainty: mixed(FIT_RMS, PLATEAU_AOD[1]) * left.min(1.0),
        stratospheric_aod_550,
        gads_aod_550,
        anthropogenic_aod_550,
        mixture,
    })
}

impl Gads {
    fn at(&self, latitude_deg: f64, longitude_deg: f64, instant: &Instant) -> Node {
        let summer = july_weight(instant);
        let season_nodes = GRID.rows * GRID.columns;
        let mut out = Node::default();
        for (i, weight) in GRID.corners(latitude_deg, longitude_deg) {
            for (season, share) in [(0, 1.0 - summer), (1, summer)] {
                out.add(&self.nodes[season * season_nodes + i], weight * share);
            }
        }
        out
    }
}

impl Node {
    fn add(&mut self, other: &Self, weight: f64) {
        for (mine, theirs) in self.number.iter_mut().zip(&other.number) {
            for (m, t) in mine.iter_mut().zip(theirs) {
                *m += weight * t;
            }
        }
        self.mineral += weight * other.mineral;
        self.humidity += weight * other.humidity;
        self.free_from_m += weight * other.free_from_m;
        self.aod += weight * other.aod;
    }
}

/// Share of urban aerosol: cities near by, each thinning out with distance and growing with its people.
fn urban_share(latitude_deg: f64, longitude_deg: f64) -> Result<f64> {
    let near = |c: &&gazetteer::City| (c.latitude_deg - latitude_deg).abs() < 2.0;
    let one = |c: &gazetteer::City| {
        let km = c.distance_km(latitude_deg, longitude_deg);
        (c.population / CITY_PEOPLE).powf(0.7) * (-0.5 * (km / CITY_KM).powi(2)).exp()
    };
    let large = gazetteer::cities()?
        .iter()
        .take_while(|c| c.population >= CITY_LEAST);
    let sum: f64 = large.filter(near).map(one).sum();
    Ok(URBAN_MOST * (1.0 - (-sum).exp()))
}

/// Optical depth at 550 nm of a mixing layer over its ground.
fn depth(number: &[f64; 10], shape: usize, humidity: f64, extinction: &Extinction) -> f64 {
    let one = |c: usize| number[c] * 1e6 * extinction.at(c, humidity);
    (0..10).map(one).sum::<f64>() * thickness_m(SHAPES[shape])
}

/// Adds OPAC's continental average in the amount of an optical depth: the anthropogenic plumes.
fn add_haze(node: &mut Node, aod_550: f64, extinction: &Extinction) {
    let mut haze = [0.0; 10];
    haze[..3].copy_from_slice(&HAZE_CM3);
    let scale = aod_550 / depth(&haze, CONTINENTAL, node.humidity, extinction);
    for (number, h) in node.number[CONTINENTAL].iter_mut().zip(haze) {
        *number += scale * h;
    }
}

/// Replaces a share of the mixing layer by OPAC's urban aerosol of the same optical depth.
fn add_city(node: &mut Node, urban: f64, extinction: &Extinction) {
    if urban <= 0.0 {
        return;
    }
    let humidity = node.humidity;
    let before: f64 = (0..5)
        .map(|s| depth(&node.number[s], s, humidity, extinction))
        .sum();
    let mut city = [0.0; 10];
    city[..3].copy_from_slice(&URBAN_CM3);
    let scale = urban * before / depth(&city, CONTINENTAL, humidity, extinction);
    for number in node.number.iter_mut().flatten() {
        *number *= 1.0 - urban;
    }
    for (number, c) in node.number[CONTINENTAL].iter_mut().zip(city) {
        *number += scale * c;
    }
}

/// `∫ profile dz` of a mixing layer from its ground up \[m\].
fn thickness_m((_, top_m, scale_height_m): (&str, f64, Option<f64>)) -> f64 {
    scale_height_m.map_or(top_m, |h| h * (1.0 - (-top_m / h).exp()))
}

/// The layers of a node whose ground lies at `ground_m`.
fn layers(node: &Node, ground_m: f64) -> AerosolMixture {
    let part = |id, per_cm3: f64, humidity_percent| MixtureComponent {
        id,
        number_density: per_cm3 * 1e6,
        humidity_percent,
    };
    let mut layers = Vec::new();
    for (shape, (name, top_m, scale_height_m)) in SHAPES.into_iter().enumerate() {
        let numbers = COMPONENTS.into_iter().zip(node.number[shape]);
        let components: Vec<_> = numbers
            .filter(|(_, n)| *n > 0.0)
            .map(|(id, n)| part(id, n, None))
            .collect();
        layers.push(MixtureLayer {
            name,
            reference_m: ground_m,
            bottom_m: ground_m - BELOW_GROUND_M,
            top_m: ground_m + top_m,
            scale_height_m,
            components,
        });
    }
    layers.push(MixtureLayer {
        name: "transported mineral",
        reference_m: ground_m,
        bottom_m: ground_m + MINERAL_M[0],
        top_m: ground_m + MINERAL_M[1],
        scale_height_m: None,
        components: if node.mineral > 0.0 {
            vec![part("mitr", node.mineral, None)]
        } else {
            Vec::new()
        },
    });
    let free = FREE.into_iter().map(|(id, h, n)| part(id, n, Some(h)));
    layers.push(MixtureLayer {
        name: "free troposphere",
        reference_m: 2e3,
        // Whole metres: an edge must meet the other layers' edges, or keep clear of them.
        bottom_m: ground_m + node.free_from_m.round(),
        top_m: FREE_TOP_M,
        scale_height_m: Some(8e3),
        components: free.collect(),
    });
    layers.retain(|l| !l.components.is_empty() && l.bottom_m < l.top_m);
    AerosolMixture {
        layers,
        humidity_percent: node.humidity,
        nearest_type: "background",
        share: [0.0; 4],
        urban: 0.0,
    }
}

/// Shares of mineral, sea salt, soot and all else in the tropospheric optical depth above an altitude.
fn shares(mixture: &AerosolMixture, extinction: &Extinction, altitude_m: f64) -> [f64; 4] {
    let mut share = [0.0; 4];
    for layer in &mixture.layers {
        let column = layer.column_above(altitude_m);
        for c in &layer.components {
            let humidity = c.humidity_percent.unwrap_or(mixture.humidity_percent);
            let kind = match c.id {
                "minm" | "miam" | "micm" | "mitr" => 0,
                "ssam" | "sscm" => 1,
                "soot" => 2,
                _ => 3,
            };
            share[kind] += c.number_density * column * extinction.named(c.id, humidity);
        }
    }
    let sum: f64 = share.iter().sum();
    share.map(|s| if sum > 0.0 { s / sum } else { 0.0 })
}

/// The AIAA type most like a mixture, by what its optical depth is made of.
///
/// `of_poles` are the parts of the arctic and the antarctic mixing layer in it, `above_m` is the height of the place above the
/// ground of its region.
fn nearest_type(
    mixture: &AerosolMixture,
    of_poles: [f64; 2],
    latitude_deg: f64,
    above_m: f64,
) -> &'static str {
    let [mineral, salt, soot, _] = mixture.share;
    let [arctic, antarctic] = of_poles;
    if latitude_deg < -66.5 || antarctic > 0.4 {
        "antarctic"
    } else if above_m > 1500.0 {
        "background"
    } else if latitude_deg > 66.5 || arctic > 0.4 {
        "arctic"
    } else if mineral > 0.5 {
        "desert"
    } else if mineral > 0.2 && salt > 0.15 {
        "maritime-mineral"
    } else if salt > 0.4 {
        "maritime-clean"
    } else if salt > 0.15 {
        "maritime-polluted"
    } else if mixture.urban > 0.5 * URBAN_MOST || soot > 0.2 {
        "urban"
    } else if soot > 0.06 {
        "rural"
    } else {
        "continental"
    }
}

fn gads() -> Result<&'static Gads> {
    static GADS: OnceLock<Result<Gads>> = OnceLock::new();
    cached(&GADS, load)
}

fn load() -> Result<Gads> {
    let extinction = load_extinction()?;
    let table = Table::parse(
        "climate_aerosol_gads",
        include_str!("../../../../data/climate_aerosol_gads/grid.csv"),
    )?;
    if table.len() != 2 * GRID.rows * GRID.columns {
        return Err(damaged("climate_aerosol_gads"));
    }
    let profile = table.numbers("profile")?;
    let humidity = table.numbers("humidity_percent")?;
    let mineral = table.numbers("mitr_upper")?;
    let columns: Vec<Vec<f64>> = COMPONENTS
        .iter()
        .map(|name| table.numbers(name))
        .collect::<Result<_>>()?;
    let mut nodes = Vec::with_capacity(table.len());
    for i in 0..table.len() {
        let known = PROFILES.get((profile[i] as usize).wrapping_sub(1));
        let &(shape, free_from_m) = known.ok_or_else(|| damaged("climate_aerosol_gads"))?;
        let mut node = Node {
            mineral: mineral[i],
            humidity: humidity[i],
            free_from_m,
            ..Node::default()
        };
        for (number, column) in node.number[shape].iter_mut().zip(&columns) {
            *number = column[i];
        }
        let all = layers(&node, 0.0);
        let depths = all
            .layers
            .iter()
            .map(|l| extinction.layer(l, node.humidity, 0.0));
        node.aod = depths.sum::<f64>() + extinction.stratosphere();
        nodes.push(node);
    }
    Ok(Gads { nodes, extinction })
}

fn load_extinction() -> Result<Extinction> {
    let table = Table::parse(
        "climate_aerosol_gads extinction",
        include_str!("../../../../data/climate_aerosol_gads/extinction_550.csv"),
    )?;
    let mut classes = Vec::new();
    for name in COMPONENTS {
        let own = table.select("component", name)?;
        if own.is_empty() {
            return Err(damaged("climate_aerosol_gads extinction"));
        }
        // 1 km⁻¹ of 1 cm⁻³ is 1e-3 m⁻¹ of 1e6 m⁻³.
        let per_particle = own.numbers("extinction_per_km")?;
        let m2 = per_particle.iter().map(|e| e * 1e-9).collect();
        classes.push((own.numbers("humidity_percent")?, m2));
    }
    Ok(Extinction { classes })
}

#[cfg(test)]
mod tests;
