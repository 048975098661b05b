//! An inventory as a figure: six charts, for looking at.

use super::{Inventory, Species};
use crate::image::svg::{page, Axis, Chart, Line, COLOURS};
use crate::image::Metadata;

/// Size of a chart \[px\].
const CHART_PX: (f64, f64) = (470.0, 410.0);
/// Highest altitude shown \[km\].
const TOP_KM: f64 = 100.0;
/// Logarithmic axes reach from the largest value down to these shares of it.
const SHARE_DENSITY: f64 = 1e-20;
const SHARE_COEFFICIENT: f64 = 1e-7;
const SHARE_DEPTH: f64 = 1e-5;
const SHARE_PHASE: f64 = 1e-5;

impl Inventory {
    /// Temperature, densities, coefficients, optical depths, albedo and asymmetry, and phase functions as an SVG picture.
    ///
    /// The title is made of the place, the time and the aerosol in the metadata.
    pub fn svg(&self, metadata: &Metadata) -> String {
        let green = self.nearest_wavelength(550.0);
        let charts = [
            self.temperature(),
            self.densities(),
            self.coefficients(green),
            self.depths(),
            self.albedo(),
            self.phases(green),
        ];
        page(&title(metadata), &charts, 3, CHART_PX)
    }

    fn altitude_axis(&self) -> Axis {
        Axis::root("altitude (km)", TOP_KM)
    }

    /// A line for every species that is there, always in its own colour: one legend serves all charts.
    fn lines(&self, mut points: impl FnMut(&Species) -> Vec<(f64, f64)>) -> Vec<Line> {
        let line = |(i, species): (usize, &Species)| Line {
            name: species.name.clone(),
            colour: COLOURS[i % COLOURS.len()].to_owned(),
            dashed: species.is_aerosol,
            points: points(species),
        };
        let mut lines: Vec<Line> = self.species.iter().enumerate().map(line).collect();
        lines.retain(|l| l.points.iter().any(|p| p.0 > 0.0 && p.1 > 0.0));
        lines
    }

    /// x is a value at each altitude.
    fn along_altitude(&self, value: impl Fn(usize) -> f64) -> Vec<(f64, f64)> {
        let nodes = self.altitude_m.iter().enumerate();
        nodes.map(|(i, z)| (value(i), z * 1e-3)).collect()
    }

    fn temperature(&self) -> Chart {
        let (low, high) = range(&self.temperature_k);
        // Names without a line, for the legend of all charts; the curve makes room for them.
        let mut lines = self.lines(|s| vec![(s.tau().iter().sum(), 1.0)]);
        lines.iter_mut().for_each(|l| l.points.clear());
        lines.push(sum_line("everything", false, Vec::new()));
        lines.push(sum_line("all aerosol", true, Vec::new()));
        lines.push(sum_line(
            "",
            false,
            self.along_altitude(|i| self.temperature_k[i]),
        ));
        Chart {
            title: "Temperature".to_owned(),
            x: Axis::linear("temperature (K)", low - 90.0..high + 10.0),
            y: self.altitude_axis(),
            lines,
            legend: (0.0, 1.0),
        }
    }

    fn densities(&self) -> Chart {
        let all = self.species.iter().flat_map(|s| &s.number_density).copied();
        // Pairs are the same molecules as oxygen.
        let mut lines = self.lines(|s| self.along_altitude(|i| s.number_density[i]));
        lines.retain(|l| l.name != "oxygen pairs");
        Chart {
            title: "Molecules and particles".to_owned(),
            x: Axis::log("number density (m⁻³)", all, SHARE_DENSITY),
            y: self.altitude_axis(),
            lines: without_names(lines),
            legend: (0.0, 0.0),
        }
    }

    fn coefficients(&self, green: usize) -> Chart {
        let w = self.wavelength_nm.len();
        let sigma =
            |s: &Species, i: usize| 1e3 * (s.sigma_s[i * w + green] + s.sigma_a[i * w + green]);
        let lines = self.lines(|s| self.along_altitude(|i| sigma(s, i)));
        let all = lines.iter().flat_map(|l| &l.points).map(|p| p.0);
        Chart {
            title: format!("Extinction at {} nm", self.wavelength_nm[green]),
            x: Axis::log("coefficient (km⁻¹)", all, SHARE_COEFFICIENT),
            y: self.altitude_axis(),
            lines: without_names(lines),
            legend: (0.0, 0.0),
        }
    }

    fn depths(&self) -> Chart {
        let spectrum = |tau: Vec<f64>| self.wavelength_nm.iter().copied().zip(tau).collect();
        let mut lines = self.lines(|s| spectrum(s.tau()));
        lines.push(sum_line("everything", false, spectrum(self.tau())));
        Chart {
            title: "Vertical optical depth".to_owned(),
            x: self.wavelength_axis(),
            y: Axis::log("optical depth", self.tau().into_iter(), SHARE_DEPTH),
            lines: without_names(lines),
            legend: (0.0, 0.0),
        }
    }

    fn albedo(&self) -> Chart {
        let line = |name: &str, colour: &str, values: &[f64]| Line {
            name: name.to_owned(),
            colour: colour.to_owned(),
            dashed: false,
            points: self
                .wavelength_nm
                .iter()
                .copied()
                .zip(values.iter().copied())
                .collect(),
        };
        let (low, high) = range(&self.aerosol.angstrom);
        let halves = |v: f64| (2.0 * v).ceil() / 2.0;
        let (low, high) = (-halves(-low.min(0.0)), halves(high.max(1.01)));
        Chart {
            title: "All aerosol of the column".to_owned(),
            x: self.wavelength_axis(),
            y: Axis::linear("albedo, asymmetry, exponent", low..high),
            lines: vec![
                line("single-scattering albedo", COLOURS[0], &self.aerosol.ssa),
                line("asymmetry", COLOURS[1], &self.aerosol.asymmetry),
                line("Ångström exponent", COLOURS[2], &self.aerosol.angstrom),
            ],
            legend: (1.0, 0.0),
        }
    }

    fn phases(&self, green: usize) -> Chart {
        let t = self.theta_deg.len();
        let curve = |phase: &[f64]| -> Vec<(f64, f64)> {
            let row = phase[green * t..(green + 1) * t].iter();
            self.theta_deg.iter().copied().zip(row.copied()).collect()
        };
        let mut lines = self.lines(|s| {
            s.scattering
                .as_ref()
                .map_or(Vec::new(), |p| curve(&p.phase))
        });
        lines.push(sum_line("all aerosol", true, curve(&self.aerosol.phase)));
        let all = lines.iter().flat_map(|l| &l.points).map(|p| p.1);
        Chart {
            title: format!("Phase functions at {} nm", self.wavelength_nm[green]),
            x: Axis::linear("scattering angle (deg)", 0.0..180.0),
            y: Axis::log("phase function (sr⁻¹)", all, SHARE_PHASE),
            lines: without_names(lines),
            legend: (0.0, 0.0),
        }
    }

    fn wavelength_axis(&self) -> Axis {
        let (low, high) = range(&self.wavelength_nm);
        // A single wavelength needs some width too.
        let more = if high > low { 0.0 } else { 5.0 };
        Axis::linear("wavelength (nm)", low - more..high + more)
    }
}

/// A black line.
fn sum_line(name: &str, dashed: bool, points: Vec<(f64, f64)>) -> Line {
    Line {
        name: name.to_owned(),
        colour: "#000000".to_owned(),
        dashed,
        points,
    }
}

fn without_names(mut lines: Vec<Line>) -> Vec<Line> {
    lines.iter_mut().for_each(|l| l.name.clear());
    lines
}

/// The smallest and the largest value; the wrong way round if there is none.
fn range(values: &[f64]) -> (f64, f64) {
    let finite = values.iter().copied().filter(|v| v.is_finite());
    finite.fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), v| {
        (low.min(v), high.max(v))
    })
}

fn title(metadata: &Metadata) -> String {
    let value = |key: &str| {
        metadata
            .iter()
            .find(|(n, _)| n == key)
            .map(|(_, v)| v.as_str())
    };
    let mut parts = vec!["The air".to_owned()];
    if let (Some(latitude), Some(longitude)) = (value("latitude_deg"), value("longitude_deg")) {
        parts.push(format!("at {latitude}°, {longitude}°"));
    }
    if let Some(time) = value("time") {
        parts.push(format!("on {time}"));
    }
    if let (Some(aerosol), Some(aod)) = (value("aerosol"), value("aod_550")) {
        parts.push(format!(
            "with aerosol '{aerosol}', optical depth {aod} at 550 nm"
        ));
    }
    parts.join(" ")
}
