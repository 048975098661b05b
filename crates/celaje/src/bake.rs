//! Baked skies: solved once for every place of the sun, then looked at again and again, kept in a file.
//!
//! A [`Sky`] that has been [baked](Sky::baked) carries its tables. [`Sky::under`] puts another sun above it within
//! milliseconds, and every view of it by the method `shells`, from the ground up to the altitude baked for, comes from the
//! same tables.

use std::path::Path;
use std::sync::atomic::AtomicBool;
use std::sync::Arc;

use crate::climate::Condition;
use crate::error::{check_range, Error, Result};
use crate::image::{read_packed, write_packed};
use crate::math::bytes::{ByteReader, ByteWriter};
use crate::math::Vec3;
use crate::medium::{LayeredMedium, Medium};
use crate::place::SunPosition;
use crate::sky::Sky;
use crate::transport::{Accuracy, Solution, SunLight, Tables, TablesOptions};

/// What a sky is baked for.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct BakeOptions {
    /// How fine the grids are.
    pub accuracy: Accuracy,
    /// True elevations of the sun, lowest and highest \[deg\], −90 to 90.
    pub sun_elevation_deg: (f64, f64),
    /// The highest observer above sea level \[m\].
    pub highest_observer_m: f64,
    /// Whether light is polarised on its way, or a scalar.
    pub polarised: bool,
}

impl Default for BakeOptions {
    /// Every sun that lights the sky of an observer on the ground or in the air.
    fn default() -> Self {
        Self {
            accuracy: Accuracy::Default,
            sun_elevation_deg: (-18.0, 90.0),
            highest_observer_m: 20_000.0,
            polarised: true,
        }
    }
}

/// What a file of tables says of how it came about: names and values.
pub type Origin = Vec<(String, String)>;

impl Sky {
    /// The same sky with its tables, solved for a range of suns.
    ///
    /// `cancel` set to `true` stops the work within milliseconds.
    ///
    /// # Errors
    /// [`Error::OutOfRange`], [`Error::Interrupted`].
    pub fn baked(&self, options: &BakeOptions, cancel: &AtomicBool) -> Result<Self> {
        let (lowest, highest) = options.sun_elevation_deg;
        check_range("lowest sun elevation", lowest, "deg", -90.0..=90.0)?;
        check_range("highest sun elevation", highest, "deg", lowest..=90.0)?;
        let ground_m = self.ground_altitude_m();
        let top_m = options.highest_observer_m;
        check_range("highest observer", top_m, "m", ground_m..=1e9)?;
        let tables = Tables::solve(
            &self.medium,
            &self.albedo,
            &TablesOptions {
                accuracy: options.accuracy,
                sun_zenith_deg: (90.0 - highest, 90.0 - lowest),
                highest_observer_m: self.medium.ground_radius_m() + (top_m - ground_m),
                sun_angular_radius_deg: self.sun.angular_radius_rad().to_degrees(),
                max_order: None,
                polarised: options.polarised,
            },
            cancel,
        )?;
        Ok(Self {
            tables: Some(Arc::new(tables)),
            ..self.clone()
        })
    }

    /// The same air and ground under another sun: its place, its irradiance and its size, which follow its distance.
    ///
    /// The conditions, if there are any, are those of before apart from the sun's; they belong to no instant any more.
    ///
    /// # Errors
    /// None for any [`SunPosition`].
    pub fn under(&self, sun: &SunPosition) -> Result<Self> {
        let nearer = self.sun_distance_au / sun.distance_au();
        let w = self.wavelength_nm().len();
        let irradiance: Vec<f64> = self.sun.irradiance[..w]
            .iter()
            .map(|&e| f64::from(e) * nearer * nearer)
            .collect();
        let light = SunLight::new(
            Vec3::from_azimuth_elevation_deg(sun.azimuth_deg(), sun.elevation_deg()),
            self.wavelength_nm(),
            &irradiance,
            self.sun.angular_radius_rad().to_degrees() * nearer,
        )?;
        let mut sky = Self {
            sun: light,
            sun_distance_au: sun.distance_au(),
            ..self.clone()
        };
        if let Some(conditions) = &mut sky.conditions {
            conditions.sun_elevation_deg = Condition::given(sun.elevation_deg(), "deg");
            conditions.sun_azimuth_deg = Condition::given(sun.azimuth_deg(), "deg");
            conditions.sun_distance_au = Condition::given(sun.distance_au(), "au");
            conditions.time = None;
            conditions.moon = None;
        }
        Ok(sky)
    }

    /// Spectral radiance in many directions under many suns, by the tables; without the sun's disc.
    ///
    /// # Arguments
    /// * `suns` — shape (s,)
    /// * `directions` — where the observer looks, unit vectors: x east, y north, z up; shape (d,)
    /// * `altitude_m` — observer above sea level; `None` is on the ground
    ///
    /// Returns radiances \[W m⁻² sr⁻¹ nm⁻¹\], shape (s, d, w).
    ///
    /// # Errors
    /// [`Error::Invalid`] for a sky that is not baked; [`Error::OutOfRange`] for a sun or an altitude not baked for.
    pub fn radiance_under(
        &self,
        suns: &[SunPosition],
        directions: &[Vec3],
        altitude_m: Option<f64>,
    ) -> Result<Vec<f32>> {
        let tables = self.tables.as_ref().ok_or_else(not_baked)?;
        let radius_m = self.observer_radius_m(altitude_m)?;
        let mut radiance = Vec::new();
        for sun in suns {
            let light = self.under(sun)?.sun;
            radiance.extend(tables.radiance(&light, radius_m, directions)?);
        }
        Ok(radiance)
    }

    /// Writes the tables of a baked sky, with all that looking at it takes, to a file, whole or not at all.
    ///
    /// # Arguments
    /// * `origin` — what the file is to say of how it came about
    ///
    /// # Errors
    /// [`Error::Invalid`] for a sky that is not baked; [`Error::File`].
    pub fn save_tables(&self, path: &Path, origin: &[(String, String)]) -> Result<()> {
        let tables = self.tables.as_ref().ok_or_else(not_baked)?;
        let solutions = tables.solutions().ok_or_else(not_baked)?;
        let mut w = ByteWriter::new();
        w.count(origin.len());
        for (name, value) in origin {
            w.text(name);
            w.text(value);
        }
        self.medium.encode(&mut w);
        w.f64s(&self.albedo);
        w.f64(self.sun_distance_au);
        w.f64(self.sun.angular_radius_rad().to_degrees());
        let (azimuth_deg, elevation_deg) = self.sun.direction.to_azimuth_elevation_deg();
        w.f64(azimuth_deg);
        w.f64(elevation_deg);
        w.f32s(&self.sun.irradiance[..self.wavelength_nm().len()]);
        w.text(tables.accuracy().name());
        for solution in solutions {
            w.f64s(&solution.radius_m);
            w.f64s(&solution.sun_zenith_deg);
            w.count(solution.degree);
            w.count(solution.polarised_degree);
            w.counts(&solution.chosen);
            w.f32s(&solution.moments);
            w.f32s(&solution.flux);
        }
        write_packed(path, &w.into_bytes())
    }

    /// The baked sky of a file, under the sun it was saved with; and what the file says of how it came about.
    ///
    /// Its conditions and its composition are none: they are words in the file by now.
    ///
    /// # Errors
    /// [`Error::File`] for a file that is missing, none of ours, of another version, cut short or damaged, or whose
    /// values do not fit each other.
    pub fn load_tables(path: &Path) -> Result<(Self, Origin)> {
        let bytes = read_packed(path)?;
        decode(&bytes).map_err(|e| Error::File {
            path: path.display().to_string(),
            message: format!("its values do not fit each other: {e}"),
            hint: "make it again with celaje bake".to_owned(),
        })
    }
}

fn decode(bytes: &[u8]) -> Result<(Sky, Origin)> {
    let mut r = ByteReader::new(bytes);
    let entries = r.count()?;
    let mut origin = Vec::new();
    for _ in 0..entries {
        origin.push((r.text()?, r.text()?));
    }
    let medium = LayeredMedium::decode(&mut r)?;
    let albedo = r.f64s()?;
    let sun_distance_au = r.f64()?;
    let radius_deg = r.f64()?;
    let (azimuth_deg, elevation_deg) = (r.f64()?, r.f64()?);
    let irradiance: Vec<f64> = r.f32s()?.into_iter().map(f64::from).collect();
    let accuracy = Accuracy::named(&r.text()?)?;
    let solutions = [decode_solution(&mut r)?, decode_solution(&mut r)?];
    r.finish()?;
    let position = SunPosition::new(azimuth_deg, elevation_deg, sun_distance_au)?;
    let tables = Tables::from_solutions(&medium, &albedo, accuracy, solutions)?;
    let mut sky = Sky::from_medium(
        medium,
        position.elevation_deg(),
        position.azimuth_deg(),
        &albedo,
        &irradiance,
        radius_deg,
    )?;
    sky.sun_distance_au = sun_distance_au;
    sky.tables = Some(Arc::new(tables));
    Ok((sky, origin))
}

fn decode_solution(r: &mut ByteReader<'_>) -> Result<Solution> {
    Ok(Solution {
        radius_m: r.f64s()?,
        sun_zenith_deg: r.f64s()?,
        degree: r.count()?,
        polarised_degree: r.count()?,
        chosen: r.counts()?,
        moments: r.f32s()?,
        flux: r.f32s()?,
    })
}

fn not_baked() -> Error {
    Error::invalid("this sky has no tables", "bake it first")
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::climate::{Conditions, Overrides};
    use crate::sensor::Directions;
    use crate::sky::{Method, RenderOptions, SunDisc};
    use crate::spectrum::{SolarSpectrum, WavelengthGrid};
    use crate::transport::Budget;

    const LOOKS: [(f64, f64); 4] = [(180.0, 4.0), (200.0, 30.0), (20.0, 60.0), (0.0, 90.0)];

    fn conditions(elevation_deg: f64, distance_au: f64) -> Conditions {
        let overrides = Overrides {
            sun_distance_au: Some(distance_au),
            ..Overrides::default()
        };
        Conditions::from_sun(elevation_deg, 170.0, &overrides).unwrap()
    }

    fn sky(elevation_deg: f64, distance_au: f64) -> Sky {
        let grid = WavelengthGrid::new(vec![450.0, 550.0, 650.0]).unwrap();
        let conditions = conditions(elevation_deg, distance_au);
        Sky::new(conditions, &grid, SolarSpectrum::Tsis1).unwrap()
    }

    fn baked(sky: &Sky) -> Sky {
        let options = BakeOptions {
            accuracy: Accuracy::Preview,
            sun_elevation_deg: (-4.0, 12.0),
            highest_observer_m: 5000.0,
            polarised: true,
        };
        sky.baked(&options, &AtomicBool::new(false)).unwrap()
    }

    fn seen(sky: &Sky, altitude_m: Option<f64>) -> Result<Vec<f32>> {
        let (azimuth, elevation): (Vec<f64>, Vec<f64>) = LOOKS.into_iter().unzip();
        let options = RenderOptions {
            method: Method::Shells,
            polarised: crate::sky::Polarised::default(),
            accuracy: Accuracy::Preview,
            budget: Budget {
                spp: 1,
                seed: 0,
                max_order: None,
            },
            sun_disc: SunDisc::Off,
            altitude_m,
        };
        let looks = Directions::new(&azimuth, &elevation).unwrap();
        let film = sky.render(&looks, &options, &AtomicBool::new(false), &|_, _| ())?;
        Ok(film.radiance)
    }

    /// Rationale: a file must stand for the solver. Expected: the same bits from the tables in memory and from the file, for
    /// suns and altitudes they were baked for; anything else refused; the batch call the same as single views.
    #[test]
    fn a_file_is_as_good_as_the_tables() {
        let folder = crate::image::test_support::Folder::new("bake");
        let path = folder.join("air.celaje");
        let first = baked(&sky(10.0, 1.0));
        let origin = vec![("aerosol".to_owned(), "σ".to_owned())];
        first.save_tables(&path, &origin).unwrap();
        let (again, told) = Sky::load_tables(&path).unwrap();
        assert_eq!(told, origin);
        assert_eq!(folder.listing(), ["air.celaje"]);
        let suns = [(10.0, None), (-3.0, None), (5.0, Some(4000.0))];
        for (elevation_deg, altitude_m) in suns {
            let sun = SunPosition::new(170.0, elevation_deg, 1.01).unwrap();
            let of = |sky: &Sky| seen(&sky.under(&sun).unwrap(), altitude_m).unwrap();
            let radiance = of(&first);
            assert!(radiance.iter().all(|&l| l > 0.0));
            assert_eq!(radiance, of(&again));
            let looks = LOOKS.map(|(a, e)| Vec3::from_azimuth_elevation_deg(a, e));
            let batch = again.radiance_under(&[sun, sun], &looks, altitude_m);
            assert_eq!(batch.unwrap(), [radiance.clone(), radiance].concat());
        }
        // On the ground, tables for observers at 5 km reach some degrees beyond what was asked for.
        let low = SunPosition::new(0.0, -25.0, 1.0).unwrap();
        assert!(seen(&again.under(&low).unwrap(), None).is_err());
        let lowest = SunPosition::new(0.0, -4.0, 1.0).unwrap();
        assert!(seen(&again.under(&lowest).unwrap(), Some(400_000.0)).is_err());
        assert!(sky(10.0, 1.0).save_tables(&path, &[]).is_err());
        assert!(sky(10.0, 1.0).radiance_under(&[low], &[], None).is_err());
    }

    /// Rationale: a sun put above baked air is the sun of a new sky. Expected: light, size and view of both agree, the view
    /// within what another range of suns changes (no node moves), 0.1 %.
    #[test]
    fn under_another_sun_it_is_another_sky() {
        let moved = baked(&sky(10.0, 0.985));
        let sun = conditions(3.0, 1.015).sun().unwrap();
        let (moved, fresh) = (moved.under(&sun).unwrap(), sky(3.0, 1.015));
        let near = |a: f64, b: f64| (a / b - 1.0).abs() < 1e-6;
        assert!(near(moved.sun.solid_angle_sr(), fresh.sun.solid_angle_sr()));
        for (a, b) in moved.sun.irradiance.iter().zip(&fresh.sun.irradiance) {
            assert!(a == b || near((*a).into(), (*b).into()));
        }
        let kept = moved.conditions.as_ref().unwrap();
        assert_eq!(kept.sun().unwrap(), sun);
        let fresh = baked(&fresh);
        for (a, b) in seen(&moved, None)
            .unwrap()
            .iter()
            .zip(seen(&fresh, None).unwrap())
        {
            assert!((a / b - 1.0).abs() < 1e-3, "{a} {b}");
        }
    }

    /// A file whose values do not fit each other is refused as such, however sound its checksum.
    #[test]
    fn values_must_fit_each_other() {
        let folder = crate::image::test_support::Folder::new("unfit");
        let path = folder.join("air.celaje");
        baked(&sky(10.0, 1.0)).save_tables(&path, &[]).unwrap();
        let bytes = read_packed(&path).unwrap();
        for cut in [0, 7, bytes.len() / 3, bytes.len() - 1] {
            write_packed(&path, &bytes[..cut]).unwrap();
            let e = Sky::load_tables(&path).unwrap_err();
            assert!(e.to_string().contains("do not fit"), "{e}");
        }
        write_packed(&path, &[&bytes[..], &[0]].concat()).unwrap();
        assert!(Sky::load_tables(&path).is_err());
    }
}
