//! `celaje radiance`: spectral radiance in a list of directions.

use std::fmt::Write as _;
use std::io::Read;
use std::path::{Path, PathBuf};

use celaje::sensor::Directions;
use celaje::sky::Method;
use celaje::Film;
use clap::Args;

use crate::failure::Failure;
use crate::options::{Air, Disc, MethodOptions, View, WhereWhen};
use crate::plan::Plan;
use crate::write_stdout;

/// Spectral radiance in a list of directions, as CSV
#[derive(Debug, Args)]
#[command(
    allow_negative_numbers = true,
    after_help = "\
Reads CSV whose first line names the columns azimuth_deg (clockwise from north) and elevation_deg, where the observer looks;
writes every line again, followed by radiance_550nm, ... [W m-2 sr-1 nm-1] and their standard errors se_550nm, ...
--polarised on adds the Stokes components q_, u_, v_ and their standard errors se_q_, se_u_, se_v_ [W m-2 sr-1 nm-1], the
degree of linear polarisation dop_ [1] and its angle from the vertical aop_ [deg], in every direction.

Examples:
  printf 'azimuth_deg,elevation_deg\\n0,90\\n180,10\\n' |
    celaje radiance --sun-elevation 30 --wavelengths 450,550,650 --directions -
  celaje radiance --sun-elevation 30 --polarised on --directions directions.csv"
)]
pub struct RadianceArgs {
    /// Scene file (TOML) with the words of these options; options given here win
    #[arg(value_name = "SCENE.toml")]
    scene: Option<PathBuf>,
    /// CSV of directions; - is standard input
    #[arg(
        long,
        value_name = "FILE|-",
        allow_hyphen_values = true,
        help_heading = "Directions"
    )]
    directions: Option<PathBuf>,
    #[command(flatten)]
    where_when: WhereWhen,
    #[command(flatten)]
    air: Air,
    #[command(flatten)]
    view: View,
    /// The sun's disc: on, off (the sky alone), only (the disc on black)
    #[arg(
        long,
        value_name = "WHICH",
        default_value = "on",
        hide_possible_values = true,
        help_heading = "View"
    )]
    sun_disc: Disc,
    #[command(flatten)]
    method: MethodOptions,
}

/// Checks everything, computes, prints.
pub fn run(args: &RadianceArgs) -> Result<(), Failure> {
    let plan = Plan::new(
        &args.where_when,
        &args.air,
        &args.view,
        &args.method,
        args.sun_disc,
        (Method::Path, 1024),
    )?;
    let Some(path) = &args.directions else {
        return Err(Failure::usage(
            "no directions are given",
            "add --directions FILE.csv, or --directions - to read standard input",
        ));
    };
    let text = read(path)?;
    let table = Table::parse(&text).map_err(|f| f.within(&path.display().to_string()))?;
    let sensor = Directions::new(&table.azimuth_deg, &table.elevation_deg)?;
    Film::check_size(table.lines.len(), 1, plan.wavelength.len())?;

    plan.note_single_paths();
    let outcome = plan.on_threads(|| plan.look(&plan.sky()?, &sensor, args.method.progress))?;
    write_stdout(&output(&table, &outcome.film))
}

fn read(path: &Path) -> Result<String, Failure> {
    let mut text = String::new();
    let read = if path == Path::new("-") {
        std::io::stdin().read_to_string(&mut text).map(|_| ())
    } else {
        std::fs::read_to_string(path).map(|t| text = t)
    };
    read.map_err(|e| Failure::unreadable(path, &e))?;
    Ok(text)
}

/// The directions, and the lines they came from.
struct Table<'a> {
    header: &'a str,
    lines: Vec<&'a str>,
    azimuth_deg: Vec<f64>,
    elevation_deg: Vec<f64>,
}

impl<'a> Table<'a> {
    /// Reads CSV; blank lines and lines beginning with # are passed over.
    fn parse(text: &'a str) -> Result<Self, Failure> {
        let text = text.strip_prefix('\u{feff}').unwrap_or(text);
        let mut lines = text
            .lines()
            .enumerate()
            .map(|(i, line)| (i + 1, line.trim()))
            .filter(|(_, line)| !line.is_empty() && !line.starts_with('#'));
        let header = lines.next().map_or("", |(_, line)| line);
        let column = |name: &str| header.split(',').position(|field| field.trim() == name);
        let (Some(azimuth), Some(elevation)) = (column("azimuth_deg"), column("elevation_deg"))
        else {
            return Err(Failure::usage(
                "the first line does not name the columns azimuth_deg and elevation_deg",
                "begin the file with the line azimuth_deg,elevation_deg",
            ));
        };
        let mut table = Self {
            header,
            lines: Vec::new(),
            azimuth_deg: Vec::new(),
            elevation_deg: Vec::new(),
        };
        for (number, line) in lines {
            let fields: Vec<&str> = line.split(',').map(str::trim).collect();
            let names = header.split(',').count();
            if fields.len() != names {
                return Err(Failure::usage(
                    format!(
                        "line {number} does not have the {names} fields that the first line names"
                    ),
                    "give every line as many fields as the first",
                ));
            }
            let field = |column: usize| fields.get(column)?.parse::<f64>().ok();
            let (Some(a), Some(e)) = (field(azimuth), field(elevation)) else {
                return Err(Failure::usage(
                    format!("line {number} does not hold two angles: '{line}'"),
                    "give azimuth and elevation in degrees, such as 180,10",
                ));
            };
            table.lines.push(line);
            table.azimuth_deg.push(a);
            table.elevation_deg.push(e);
        }
        Ok(table)
    }
}

/// The lines with radiances and standard errors; numbers are written so that they are read back bit for bit.
fn output(table: &Table<'_>, film: &Film) -> String {
    let w = film.wavelength_nm.len();
    let mut text = table.header.to_owned();
    for prefix in ["radiance", "se"] {
        for nm in &film.wavelength_nm {
            text.push_str(&format!(",{prefix}_{nm}nm"));
        }
    }
    if film.polarisation.is_some() {
        for prefix in ["q", "u", "v", "se_q", "se_u", "se_v", "dop", "aop"] {
            for nm in &film.wavelength_nm {
                text.push_str(&format!(",{prefix}_{nm}nm"));
            }
        }
    }
    text.push('\n');
    for (pixel, line) in table.lines.iter().enumerate() {
        text.push_str(line);
        let variance = &film.variance[pixel * w..(pixel + 1) * w];
        let errors = variance.iter().map(|v| v.sqrt());
        let values = film.spectrum(pixel).iter().copied().chain(errors);
        for value in values.chain(polarisation(film, pixel)) {
            // Writing to a string cannot fail.
            let _ = write!(text, ",{value:e}");
        }
        text.push('\n');
    }
    text
}

/// Q, U, V, their standard errors, degree and angle of polarisation of a pixel, each at every wavelength; nothing of a film
/// without.
fn polarisation(film: &Film, pixel: usize) -> Vec<f32> {
    let w = film.wavelength_nm.len();
    let here = pixel * w..(pixel + 1) * w;
    let Some(polarisation) = &film.polarisation else {
        return Vec::new();
    };
    let planes = polarisation.planes();
    let means = planes.iter().flat_map(|p| p.mean[here.clone()].iter());
    let variances = planes.iter().flat_map(|p| p.variance[here.clone()].iter());
    let degree = (0..w).filter_map(|k| film.degree_of_polarisation(pixel, k));
    let angle = (0..w).filter_map(|k| film.angle_of_polarisation_deg(pixel, k));
    let values = means.copied().chain(variances.map(|v| v.sqrt()));
    values.chain(degree).chain(angle).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn columns_are_found_by_name_and_lines_are_kept() {
        let text =
            "\u{feff}id,elevation_deg,azimuth_deg\r\n# comment\r\n\r\na, 10 ,-90\r\nb,90,0\r\n";
        let table = Table::parse(text).ok().unwrap();
        assert_eq!(table.azimuth_deg, [-90.0, 0.0]);
        assert_eq!(table.elevation_deg, [10.0, 90.0]);
        let mut film = Film::new(2, 1, &[450.0, 550.5]).unwrap();
        film.radiance = vec![0.1, 0.2, 0.0, 3.0];
        film.variance = vec![0.25, 0.0, 0.0, 4.0];
        assert_eq!(
            output(&table, &film),
            "id,elevation_deg,azimuth_deg,radiance_450nm,radiance_550.5nm,se_450nm,se_550.5nm\n\
             a, 10 ,-90,1e-1,2e-1,5e-1,0e0\nb,90,0,0e0,3e0,0e0,2e0\n"
        );
    }

    #[test]
    fn stokes_components_follow_the_radiance() {
        let table = Table::parse("azimuth_deg,elevation_deg\n0,90\n")
            .ok()
            .unwrap();
        let mut film = Film::new_polarised(1, 1, &[450.0]).unwrap();
        film.radiance = vec![2.0];
        if let Some(p) = &mut film.polarisation {
            (p.q.mean[0], p.v.mean[0], p.u.variance[0]) = (-1.0, 0.5, 4.0);
        }
        assert_eq!(
            output(&table, &film),
            "azimuth_deg,elevation_deg,radiance_450nm,se_450nm,q_450nm,u_450nm,v_450nm,se_q_450nm,se_u_450nm,se_v_450nm,\
             dop_450nm,aop_450nm\n0,90,2e0,0e0,-1e0,0e0,5e-1,0e0,2e0,0e0,5e-1,9e1\n"
        );
    }

    #[test]
    fn what_is_no_table_is_refused() {
        for text in [
            "",
            "0,90\n",
            "azimuth_deg,elevation_deg\n1\n",
            "azimuth_deg,elevation_deg\n1,x\n",
            "azimuth_deg,elevation_deg\n1,2,3\n",
            "azimuth_deg,elevation_deg,id\n1,2\n",
        ] {
            assert!(Table::parse(text).is_err(), "{text}");
        }
    }
}
