//! An inventory as CSV, NetCDF and SVG.

use std::fmt::Write as _;
use std::path::Path;

use super::{Inventory, Species};
use crate::error::{Error, Result};
use crate::image::netcdf::{write_netcdf, Dataset, Values, Variable};
use crate::image::{check_writable, circumstances, global_attributes, save_text, Metadata};

/// Name of the row of all aerosol together.
const ALL_AEROSOL: &str = "all aerosol";

/// A kind of file, chosen by the extension.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum InventoryFormat {
    /// One number a line, with what it is: for spreadsheets and data frames.
    Csv,
    /// Everything, with CF names.
    NetCdf,
    /// A figure.
    Svg,
}

impl InventoryFormat {
    /// The format that a file's extension names, in upper or lower case.
    ///
    /// # Errors
    /// [`Error::File`] for another extension or none.
    pub fn of(path: &Path) -> Result<Self> {
        let extension = path.extension().map(|e| e.to_ascii_lowercase());
        match extension.as_ref().and_then(|e| e.to_str()) {
            Some("csv") => Ok(Self::Csv),
            Some("nc") => Ok(Self::NetCdf),
            Some("svg") => Ok(Self::Svg),
            _ => Err(Error::File {
                path: path.display().to_string(),
                message: "the extension is none that the air can be written as".to_owned(),
                hint: "use .csv, .nc or .svg".to_owned(),
            }),
        }
    }

    /// Makes sure, before any work, that a file can be written; returns its format.
    ///
    /// # Errors
    /// [`Error::File`].
    pub fn check(path: &Path) -> Result<Self> {
        let format = Self::of(path)?;
        check_writable(path)?;
        Ok(format)
    }
}

impl Inventory {
    /// Writes the file that the extension names, whole or not at all.
    ///
    /// `metadata` are the conditions: header lines in CSV, attributes in NetCDF; the figure has its title from them.
    ///
    /// # Errors
    /// [`Error::File`]; [`Error::TooLarge`] for a NetCDF variable beyond 4 GiB.
    pub fn save(&self, path: &Path, metadata: &Metadata) -> Result<()> {
        match InventoryFormat::of(path)? {
            InventoryFormat::Csv => save_text(path, &self.csv(metadata)),
            InventoryFormat::NetCdf => write_netcdf(path, &self.dataset(metadata)),
            InventoryFormat::Svg => save_text(path, &self.svg(metadata)),
        }
    }

    /// One number a line: `quantity,species,wavelength_nm,altitude_m,angle_deg,value,unit`, empty cells where a column has no
    /// meaning. Coefficients along altitude are given at the wavelength nearest to 550 nm; all of them are in NetCDF.
    pub fn csv(&self, metadata: &Metadata) -> String {
        let mut text = String::new();
        for (name, value) in metadata {
            // Line breaks would end the comment.
            let value = value.replace(['\n', '\r'], " ");
            let _ = writeln!(text, "# {name}: {value}");
        }
        text.push_str("quantity,species,wavelength_nm,altitude_m,angle_deg,value,unit\n");
        let mut line = |quantity: &str, species: &str, at: [Option<f64>; 3], value: f64, unit| {
            let cell = |v: Option<f64>| v.map_or(String::new(), |v| v.to_string());
            let [nm, z, angle] = at.map(cell);
            let value = if value.is_nan() {
                String::new()
            } else {
                format!("{value:e}")
            };
            let _ = writeln!(text, "{quantity},{species},{nm},{z},{angle},{value},{unit}");
        };
        let green = self.nearest_wavelength(550.0);
        let (w, t) = (self.wavelength_nm.len(), self.theta_deg.len());
        for (i, &z) in self.altitude_m.iter().enumerate() {
            let at = [None, Some(z), None];
            line("temperature", "", at, self.temperature_k[i], "K");
            line("pressure", "", at, self.pressure_pa[i], "Pa");
            for s in &self.species {
                line("number_density", &s.name, at, s.number_density[i], "m-3");
                let at = [Some(self.wavelength_nm[green]), Some(z), None];
                for (quantity, sigma) in [
                    ("scattering_coefficient", &s.sigma_s),
                    ("absorption_coefficient", &s.sigma_a),
                ] {
                    line(quantity, &s.name, at, sigma[i * w + green], "m-1");
                }
            }
        }
        for (i, &nm) in self.wavelength_nm.iter().enumerate() {
            let at = [Some(nm), None, None];
            for s in &self.species {
                line("scattering_optical_depth", &s.name, at, s.tau_s[i], "1");
                line("absorption_optical_depth", &s.name, at, s.tau_a[i], "1");
            }
            for (quantity, value) in [
                ("optical_depth", &self.aerosol.tau),
                ("single_scattering_albedo", &self.aerosol.ssa),
                ("asymmetry", &self.aerosol.asymmetry),
                ("angstrom_exponent", &self.aerosol.angstrom),
            ] {
                line(quantity, ALL_AEROSOL, at, value[i], "1");
            }
        }
        for (name, _, phase) in self.scatterers() {
            for (i, &nm) in self.wavelength_nm.iter().enumerate() {
                for (j, &theta) in self.theta_deg.iter().enumerate() {
                    let at = [Some(nm), None, Some(theta)];
                    line("phase_function", name, at, phase[i * t + j], "sr-1");
                }
            }
        }
        text
    }

    /// Name, asymmetry and phase function of all that scatters; all aerosol together comes last.
    fn scatterers(&self) -> Vec<(&str, &[f64], &[f64])> {
        let mut all = Vec::new();
        for species in &self.species {
            if let Some(s) = &species.scattering {
                all.push((
                    species.name.as_str(),
                    s.asymmetry.as_slice(),
                    s.phase.as_slice(),
                ));
            }
        }
        let aerosol = &self.aerosol;
        all.push((ALL_AEROSOL, &aerosol.asymmetry, &aerosol.phase));
        all
    }

    /// Everything, with CF metadata.
    fn dataset<'a>(&'a self, metadata: &Metadata) -> Dataset<'a> {
        let scatterers = self.scatterers();
        let names = scatterers.iter().map(|s| s.0.to_owned()).collect();
        let asymmetry: Vec<f64> = scatterers.iter().flat_map(|s| s.1).copied().collect();
        let phase: Vec<f64> = scatterers.iter().flat_map(|s| s.2).copied().collect();
        let species = self.species.iter().map(|s| s.name.clone()).collect();
        let mut variables = self.axes();
        variables.extend([
            Variable::new(
                "species",
                &["species"],
                ("", "gas or layer of aerosol"),
                Values::Words(species),
            ),
            Variable::new(
                "scatterer",
                &["scatterer"],
                ("", "what scatters"),
                Values::Words(names),
            ),
        ]);
        variables.extend(circumstances(metadata));
        variables.extend(self.profiles());
        variables.extend(self.column_variables());
        let cube = ["scatterer", "wavelength", "angle"];
        variables.extend([
            Variable::doubles(
                "asymmetry",
                &cube[..2],
                ("1", "mean cosine of the scattering angle"),
                asymmetry,
            ),
            Variable::doubles(
                "phase_function",
                &cube,
                ("sr-1", "phase function, 1 over the sphere"),
                phase,
            ),
        ]);
        let mut attributes = global_attributes("What the air is made of", metadata);
        if self.extrapolated {
            let note =
                "a refractive index was extrapolated below the first wavelength of its table";
            attributes.push(("extrapolated".to_owned(), note.into()));
        }
        Dataset {
            dimensions: vec![
                ("altitude", self.altitude_m.len()),
                ("wavelength", self.wavelength_nm.len()),
                ("angle", self.theta_deg.len()),
                ("species", self.species.len()),
                ("scatterer", scatterers.len()),
            ],
            attributes,
            variables,
        }
    }

    fn axes<'a>(&'a self) -> Vec<Variable<'a>> {
        vec![
            Variable::doubles(
                "altitude",
                &["altitude"],
                ("m", "altitude above sea level"),
                self.altitude_m.as_slice(),
            )
            .with("standard_name", "altitude")
            .with("positive", "up"),
            Variable::doubles(
                "wavelength",
                &["wavelength"],
                ("nm", "vacuum wavelength"),
                self.wavelength_nm.as_slice(),
            )
            .with("standard_name", "radiation_wavelength"),
            Variable::doubles(
                "angle",
                &["angle"],
                ("degree", "scattering angle, 0 forward"),
                self.theta_deg.as_slice(),
            )
            .with("standard_name", "scattering_angle"),
        ]
    }

    fn profiles<'a>(&'a self) -> Vec<Variable<'a>> {
        let every = |of: fn(&Species) -> &Vec<f64>| -> Vec<f64> {
            self.species.iter().flat_map(of).copied().collect()
        };
        let cube = ["species", "altitude", "wavelength"];
        vec![
            Variable::doubles(
                "temperature",
                &["altitude"],
                ("K", "temperature"),
                self.temperature_k.as_slice(),
            )
            .with("standard_name", "air_temperature"),
            Variable::doubles(
                "pressure",
                &["altitude"],
                ("Pa", "pressure"),
                self.pressure_pa.as_slice(),
            )
            .with("standard_name", "air_pressure"),
            Variable::doubles(
                "number_density",
                &cube[..2],
                ("m-3", "molecules or particles"),
                every(|s| &s.number_density),
            ),
            Variable::doubles(
                "scattering_coefficient",
                &cube,
                ("m-1", "scattering coefficient"),
                every(|s| &s.sigma_s),
            ),
            Variable::doubles(
                "absorption_coefficient",
                &cube,
                ("m-1", "absorption coefficient"),
                every(|s| &s.sigma_a),
            ),
        ]
    }

    fn column_variables<'a>(&'a self) -> Vec<Variable<'a>> {
        let every = |of: fn(&Species) -> &Vec<f64>| -> Vec<f64> {
            self.species.iter().flat_map(of).copied().collect()
        };
        let plane = ["species", "wavelength"];
        let aerosol = |name: &str, long_name: &str, standard_name: &str, values: &'a [f64]| {
            Variable::doubles(name, &["wavelength"], ("1", long_name), values)
                .with("standard_name", standard_name)
        };
        let sum = &self.aerosol;
        vec![
            Variable::doubles(
                "scattering_optical_depth",
                &plane,
                ("1", "vertical, ground to space"),
                every(|s| &s.tau_s),
            ),
            Variable::doubles(
                "absorption_optical_depth",
                &plane,
                ("1", "vertical, ground to space"),
                every(|s| &s.tau_a),
            ),
            aerosol(
                "aerosol_optical_depth",
                "optical depth of all aerosol, vertical, ground to space",
                "atmosphere_optical_thickness_due_to_ambient_aerosol_particles",
                &sum.tau,
            ),
            aerosol(
                "aerosol_single_scattering_albedo",
                "single-scattering albedo of all aerosol",
                "single_scattering_albedo_in_air_due_to_ambient_aerosol_particles",
                &sum.ssa,
            ),
            aerosol(
                "aerosol_asymmetry",
                "mean cosine of the scattering angle, all aerosol",
                "asymmetry_factor_of_ambient_aerosol_particles",
                &sum.asymmetry,
            ),
            aerosol(
                "aerosol_angstrom_exponent",
                "Angstrom exponent between neighbouring wavelengths",
                "angstrom_exponent_of_ambient_aerosol_in_air",
                &sum.angstrom,
            ),
        ]
    }
}
