//! A solved atmosphere: everything that views of it need, for any sun, view and altitude.

use std::sync::atomic::AtomicBool;

use super::along::Bases;
use super::field::{Field, Solution};
use super::gather::Gatherer;
use super::march::Levels;
use super::scaled::{Scaled, Wanted};
use super::solve::{self, Problem};
use super::wavelengths::{choose, Spread};
use super::{Accuracy, Resolution};
use crate::error::{check_range, Error, Result};
use crate::film::Film;
use crate::math::{lanes, Vec3};
use crate::medium::{Columns, LayeredMedium, Medium};
use crate::sensor::Sensor;
use crate::transport::render::{Control, Observer};
use crate::transport::scene::SunLight;

/// Margin about the sun zenith angles that rays can meet, for light that comes from beyond \[deg\].
const MARGIN_DEG: f64 = 3.0;

/// How many times as far apart the levels of a view are for the coarse solution, which only has to know how wavelengths differ.
const ROUGHER: f64 = 3.0;

/// What tables are solved for.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct TablesOptions {
    /// How fine the grids are.
    pub accuracy: Accuracy,
    /// Range of the sun's zenith angles, as seen by the observers \[deg\], 0 to 180.
    pub sun_zenith_deg: (f64, f64),
    /// Distance from the planet's centre of the highest observer \[m\].
    pub highest_observer_m: f64,
    /// Angular radius of the sun \[deg\], for the twilight of points from which the planet hides part of it.
    pub sun_angular_radius_deg: f64,
    /// Orders of scattering and reflection counted, at least 1; `None` for all.
    pub max_order: Option<u32>,
    /// Whether light is polarised on its way, or a scalar.
    pub polarised: bool,
}

/// A solved atmosphere over a ground: from one of these comes any picture, whatever the sun's place, its irradiance, the
/// view and the observer's altitude, as long as the sun's zenith angle is among those solved for.
///
/// [`Tables::solutions`] holds what took long to compute, as plain arrays; [`Tables::from_solutions`] makes the same tables of
/// them, bit for bit.
#[derive(Debug, Clone)]
pub struct Tables {
    pub(super) medium: LayeredMedium,
    pub(super) albedo: Vec<f32>,
    pub(super) few_albedo: Vec<f32>,
    pub(super) accuracy: Accuracy,
    /// The medium with forward peaks cut off: at all wavelengths; at those solved well; for the coarse solution.
    pub(super) fine: Scaled,
    pub(super) few: Scaled,
    pub(super) rough: Scaled,
    /// None where only first-order light is wanted.
    pub(super) fields: Option<Fields>,
    pub(super) levels: Levels,
    pub(super) rough_levels: Levels,
    pub(super) bases: Bases,
    pub(super) rough_bases: Bases,
    polarised: bool,
    pub(super) spread: Spread,
    /// Columns of the true medium, for the sun's disc.
    pub(super) true_columns: Columns,
}

/// The solved light.
#[derive(Debug, Clone)]
pub(super) struct Fields {
    /// Solved well, at a few wavelengths.
    pub few: Field,
    /// Solved roughly, at all.
    pub rough: Field,
}

impl Tables {
    /// Solves for the diffuse light of an atmosphere.
    ///
    /// * `albedo` — of the ground, in [0, 1], shape (w,), one per wavelength of the medium
    ///
    /// `cancel` set to `true` stops the work within milliseconds.
    ///
    /// # Errors
    /// [`Error::OutOfRange`], [`Error::ShapeMismatch`], [`Error::Interrupted`].
    pub fn solve(
        medium: &LayeredMedium,
        albedo: &[f64],
        options: &TablesOptions,
        cancel: &AtomicBool,
    ) -> Result<Self> {
        let (from, to) = options.sun_zenith_deg;
        check_range("sun zenith angle", from, "deg", 0.0..=180.0)?;
        check_range("sun zenith angle", to, "deg", from..=180.0)?;
        let radius_deg = options.sun_angular_radius_deg;
        check_range("sun angular radius", radius_deg, "deg", 0.0..=45.0)?;
        let ground_m = medium.ground_radius_m();
        let highest_m = options.highest_observer_m;
        check_range(
            "radius of the highest observer",
            highest_m,
            "m",
            ground_m..=1e15,
        )?;
        check_albedo(medium, albedo)?;
        let resolution = options.accuracy.resolution();
        let few = choose(medium, albedo, resolution.wavelengths);
        let mut tables = Self::unsolved(medium, albedo, options.accuracy, few, options.polarised)?;
        if options.max_order.is_none_or(|n| n > 1) {
            let reach = reach_deg(medium, highest_m);
            let solve = |scaled: &Scaled, albedo: &[f32], resolution: &Resolution| {
                let problem = Problem {
                    albedo,
                    sun_radius_rad: radius_deg.to_radians(),
                    sun_zenith_deg: ((from - reach).max(0.0), (to + reach).min(180.0)),
                    orders: options.max_order.map(|n| n - 1),
                };
                solve::solve(scaled, &problem, resolution, cancel)
            };
            tables.fields = Some(Fields {
                few: solve(&tables.few, &tables.few_albedo, &resolution)?,
                rough: solve(&tables.rough, &tables.albedo, &resolution.rough())?,
            });
        }
        Ok(tables)
    }

    /// Tables of solutions found earlier for the same medium, albedo and accuracy, as [`Tables::solutions`] gave them.
    ///
    /// # Errors
    /// [`Error::Invalid`], [`Error::ShapeMismatch`] for solutions that cannot belong to this medium.
    pub fn from_solutions(
        medium: &LayeredMedium,
        albedo: &[f64],
        accuracy: Accuracy,
        [few, rough]: [Solution; 2],
    ) -> Result<Self> {
        let w = medium.wavelength_nm().len();
        few.check(w)?;
        rough.check(w)?;
        let resolution = accuracy.resolution();
        if few.degree != resolution.degree || rough.degree != resolution.rough().degree {
            return Err(Error::invalid(
                format!("solutions of degree {} and {}", few.degree, rough.degree),
                "give the accuracy they were solved with",
            ));
        }
        let polarised = few.polarised_degree > 0;
        let degrees = [&few, &rough].map(|s| s.polarised_degree);
        let known = [&resolution, &resolution.rough()].map(|r| r.polarised_degree);
        if polarised && degrees != known || !polarised && degrees != [0; 2] {
            return Err(Error::invalid(
                format!("solutions of degrees {degrees:?} of polarisation"),
                "give the accuracy they were solved with",
            ));
        }
        if rough.chosen.len() != w || few.sun_zenith_deg != rough.sun_zenith_deg {
            return Err(Error::invalid(
                "two solutions that do not belong together",
                "give both, the one at few wavelengths first",
            ));
        }
        let chosen = few.chosen.clone();
        let mut tables = Self::unsolved(medium, albedo, accuracy, chosen, polarised)?;
        tables.fields = Some(Fields {
            few: Field::new(few),
            rough: Field::new(rough),
        });
        Ok(tables)
    }

    /// All that does not take solving.
    fn unsolved(
        medium: &LayeredMedium,
        albedo: &[f64],
        accuracy: Accuracy,
        few: Vec<usize>,
        polarised: bool,
    ) -> Result<Self> {
        check_albedo(medium, albedo)?;
        let w = medium.wavelength_nm().len();
        let resolution = accuracy.resolution();
        let all: Vec<usize> = (0..w).collect();
        let of = |resolution: &Resolution, chosen: Vec<usize>, polarised: bool| Wanted {
            degree: resolution.degree,
            polarised_degree: if polarised {
                resolution.polarised_degree
            } else {
                0
            },
            chosen,
        };
        let rough_resolution = resolution.rough();
        let levels = |times: f64| {
            let spacing_m = times * resolution.view_level_m;
            Levels::new(medium, spacing_m, times * resolution.view_level_growth)
        };
        let wanted = [
            // Of single scattering the matrices themselves are known.
            of(&resolution, all.clone(), false),
            of(&resolution, few.clone(), polarised),
            of(&rough_resolution, all, polarised),
        ];
        let ([fine, few_scaled, rough], true_columns) = Scaled::several(medium, wanted);
        Ok(Self {
            albedo: lanes::row_from(w, |i| albedo[i]),
            few_albedo: lanes::row_from(few.len(), |i| albedo[few[i]]),
            accuracy,
            fine,
            bases: Bases::new(resolution.degree, few_scaled.polarised_degree),
            rough_bases: Bases::new(rough_resolution.degree, rough.polarised_degree),
            polarised,
            few: few_scaled,
            rough,
            fields: None,
            levels: levels(1.0),
            rough_levels: levels(ROUGHER),
            spread: Spread::new(medium, albedo, &few),
            true_columns,
            medium: medium.clone(),
        })
    }

    /// The air these tables are for.
    pub fn medium(&self) -> &LayeredMedium {
        &self.medium
    }

    /// Albedo of the ground \[1\], shape (w,).
    pub fn albedo(&self) -> Vec<f64> {
        let w = self.medium.wavelength_nm().len();
        self.albedo[..w].iter().map(|&a| f64::from(a)).collect()
    }

    /// How fine the grids are.
    pub fn accuracy(&self) -> Accuracy {
        self.accuracy
    }

    /// Whether light was polarised on its way, or a scalar.
    pub fn polarised(&self) -> bool {
        self.polarised
    }

    /// What was solved: well at a few wavelengths, roughly at all. `None` for tables of first-order light only.
    pub fn solutions(&self) -> Option<[&Solution; 2]> {
        let fields = self.fields.as_ref()?;
        Some([fields.few.solution(), fields.rough.solution()])
    }

    /// Spectral radiance at every pixel of a sensor \[W m⁻² sr⁻¹ nm⁻¹\].
    ///
    /// `control.budget.max_order` of 0 leaves the sun's disc alone, 1 single scattering; any other number is that of the
    /// tables.
    ///
    /// # Errors
    /// [`Error::OutOfRange`] for a sun that was not solved for; [`Error::ShapeMismatch`] for another number of
    /// wavelengths; [`Error::TooLarge`], [`Error::Interrupted`].
    pub fn render(
        &self,
        sun: &SunLight,
        observer: &Observer,
        sensor: &dyn Sensor,
        control: &Control<'_>,
    ) -> Result<Film> {
        self.check_view(sun, observer.radius_m)?;
        let gatherer = Gatherer::new(self, sun, control.budget.max_order, false);
        gatherer.render(observer, sensor, control)
    }

    /// [`Tables::render`] with Q and U beside the radiance; V is 0.
    ///
    /// # Errors
    /// As [`Tables::render`]; [`Error::Invalid`] for tables of scalar light.
    pub fn render_stokes(
        &self,
        sun: &SunLight,
        observer: &Observer,
        sensor: &dyn Sensor,
        control: &Control<'_>,
    ) -> Result<Film> {
        if !self.polarised {
            return Err(Error::invalid(
                "these tables hold scalar light: they do not know how it is polarised",
                "bake them with polarised on, or leave polarisation off",
            ));
        }
        self.check_view(sun, observer.radius_m)?;
        let gatherer = Gatherer::new(self, sun, control.budget.max_order, true);
        gatherer.render(observer, sensor, control)
    }

    /// Spectral radiance of the sky in many directions, without the sun's disc.
    ///
    /// * `observer_m` — distance of the observer from the planet's centre \[m\]
    /// * `directions` — where it looks, unit vectors in the frame of the sun's direction: x east, y north, z up
    ///
    /// Returns radiances \[W m⁻² sr⁻¹ nm⁻¹\], shape (direction, w).
    ///
    /// # Errors
    /// As [`Tables::render`].
    pub fn radiance(
        &self,
        sun: &SunLight,
        observer_m: f64,
        directions: &[Vec3],
    ) -> Result<Vec<f32>> {
        self.check_view(sun, observer_m)?;
        Ok(Gatherer::new(self, sun, None, false).radiance(observer_m, directions))
    }

    /// Refuses what was not solved for.
    fn check_view(&self, sun: &SunLight, observer_m: f64) -> Result<()> {
        let w = self.medium.wavelength_nm().len();
        if sun.irradiance.len() != self.medium.lanes() {
            return Err(Error::ShapeMismatch {
                name: "sun irradiance".into(),
                got: "another number of wavelengths".into(),
                expected: format!("{w} wavelengths, those of the tables"),
            });
        }
        check_range(
            "observer's distance from the planet's centre",
            observer_m,
            "m",
            self.medium.ground_radius_m()..=1e15,
        )?;
        let Some(fields) = &self.fields else {
            return Ok(());
        };
        let nodes = &fields.few.solution().sun_zenith_deg;
        let (first, last) = (nodes[0], nodes[nodes.len() - 1]);
        let reach = reach_deg(&self.medium, observer_m) - MARGIN_DEG;
        let zenith = sun.direction.z.clamp(-1.0, 1.0).acos().to_degrees();
        let least = if first <= 0.0 { 0.0 } else { first + reach };
        let most = if last >= 180.0 { 180.0 } else { last - reach };
        if (least - 1e-9..=most + 1e-9).contains(&zenith) {
            return Ok(());
        }
        Err(Error::OutOfRange {
            name: "sun zenith angle".into(),
            value: zenith,
            unit: "deg",
            range: format!("[{least:.1}, {most:.1}]"),
            hint: "these tables were not solved for this sun at this altitude".into(),
        })
    }
}

/// Refuses an albedo of another shape or out of range.
fn check_albedo(medium: &LayeredMedium, albedo: &[f64]) -> Result<()> {
    let w = medium.wavelength_nm().len();
    if albedo.len() != w {
        return Err(Error::ShapeMismatch {
            name: "albedo".into(),
            got: format!("({},)", albedo.len()),
            expected: format!("({w},), one value per wavelength"),
        });
    }
    for &a in albedo {
        check_range("albedo", a, "", 0.0..=1.0)?;
    }
    Ok(())
}

/// How far from the observer's own the sun's zenith angle can be where a ray passes \[deg\]: from the observer down to the
/// horizon and up again to the top of the air; and a margin.
fn reach_deg(medium: &LayeredMedium, observer_m: f64) -> f64 {
    let ground = medium.ground_radius_m();
    let to_horizon = |r: f64| (ground / r).min(1.0).acos().to_degrees();
    to_horizon(observer_m) + to_horizon(medium.top_radius_m()) + MARGIN_DEG
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::optics::Phase;

    fn medium() -> LayeredMedium {
        let z: Vec<f64> = (0..=40).map(|i| 62.5 * f64::from(i * i)).collect();
        let mut m = LayeredMedium::new(&z, &[450.0, 550.0, 650.0], 6_360_000.0).unwrap();
        let rows = |sigma: [f64; 3], scale_m: f64| -> Vec<f64> {
            z.iter()
                .flat_map(|z| sigma.map(|s| s * (-z / scale_m).exp()))
                .collect()
        };
        let none = rows([0.0; 3], 1.0);
        let air = Phase::rayleigh(&[0.03; 3]).unwrap();
        m.add(&rows([2.7e-5, 1.2e-5, 6e-6], 8000.0), &none, air)
            .unwrap();
        let haze = Phase::henyey_greenstein(&[0.75, 0.72, 0.7]).unwrap();
        m.add(&rows([2e-4, 1.6e-4, 1.3e-4], 1500.0), &none, haze)
            .unwrap();
        m
    }

    fn options(m: &LayeredMedium, zenith_deg: (f64, f64)) -> TablesOptions {
        TablesOptions {
            accuracy: Accuracy::Preview,
            sun_zenith_deg: zenith_deg,
            highest_observer_m: m.ground_radius_m(),
            sun_angular_radius_deg: 0.2666,
            max_order: None,
            polarised: false,
        }
    }

    fn sun(elevation_deg: f64, radius_deg: f64) -> SunLight {
        let towards = Vec3::from_azimuth_elevation_deg(120.0, elevation_deg);
        SunLight::new(
            towards,
            &[450.0, 550.0, 650.0],
            &[2.0, 1.8, 1.6],
            radius_deg,
        )
        .unwrap()
    }

    /// Rationale: baked tables stand for the solver. Expected: tables made of the arrays answer with the same bits; arrays
    /// that are cut short, out of order or of another degree are refused.
    #[test]
    fn tables_come_back_from_their_arrays() {
        let m = medium();
        let albedo = [0.2; 3];
        let run = AtomicBool::new(false);
        let tables = Tables::solve(&m, &albedo, &options(&m, (60.0, 61.0)), &run).unwrap();
        let both = tables.solutions().unwrap().map(Clone::clone);
        let again = Tables::from_solutions(&m, &albedo, Accuracy::Preview, both.clone()).unwrap();
        let looks = [
            Vec3::from_azimuth_elevation_deg(40.0, 25.0),
            Vec3::new(0.0, 0.0, 1.0),
        ];
        let (sun, r) = (sun(29.5, 0.27), m.ground_radius_m());
        let seen = tables.radiance(&sun, r, &looks).unwrap();
        assert_eq!(seen, again.radiance(&sun, r, &looks).unwrap());
        assert!(seen.iter().all(|&l| l > 0.0));

        let refuse = |change: &dyn Fn(&mut Solution)| {
            let mut bad = both.clone();
            change(&mut bad[0]);
            assert!(Tables::from_solutions(&m, &albedo, Accuracy::Preview, bad).is_err());
        };
        refuse(&|s| s.moments.truncate(10));
        refuse(&|s| s.flux[0] = f32::NAN);
        refuse(&|s| s.chosen[0] = 7);
        refuse(&|s| s.sun_zenith_deg.swap(0, 1));
        refuse(&|s| s.degree = 1_000_000_000);
        let high = Tables::from_solutions(&m, &albedo, Accuracy::High, both);
        assert!(high.is_err());
    }

    /// Rationale: nodes stand at fixed sun angles, so the sky does not depend on which suns were solved together.
    /// Expected: tables of one sun and of a wide range agree in the first four orders, whose number does not depend on the
    /// slowest node's convergence; suns beyond are refused.
    #[test]
    fn one_sun_or_many() {
        let m = medium();
        let run = AtomicBool::new(false);
        let solve = |zenith| {
            let mut options = options(&m, zenith);
            options.max_order = Some(4);
            Tables::solve(&m, &[0.2; 3], &options, &run).unwrap()
        };
        let (one, many) = (solve((60.0, 60.0)), solve((30.0, 92.0)));
        let looks = [Vec3::from_azimuth_elevation_deg(40.0, 25.0)];
        let r = m.ground_radius_m();
        let a = one.radiance(&sun(30.0, 0.27), r, &looks).unwrap();
        let b = many.radiance(&sun(30.0, 0.27), r, &looks).unwrap();
        for (a, b) in a.iter().zip(&b) {
            assert!((a / b - 1.0).abs() < 1e-3, "{a} {b}");
        }
        assert!(one.radiance(&sun(80.0, 0.27), r, &looks).is_err());
        assert!(many.radiance(&sun(-10.0, 0.27), r, &looks).is_err());
        assert!(many.radiance(&sun(30.0, 0.27), r - 5.0, &looks).is_err());
    }
}
