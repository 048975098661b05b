//! `celaje atmosphere`: what the air is made of, and what each part does to light.

use std::fmt::Write as _;
use std::path::PathBuf;

use celaje::composition::aerosol::AerosolType;
use celaje::inventory::{Inventory, InventoryFormat, Species};
use celaje::sky::Composition;
use clap::Args;
use serde_json::{json, Value};

use crate::failure::Failure;
use crate::interrupt;
use crate::options::{wavelengths, Air, WhereWhen};
use crate::plan::condition_entries;
use crate::write_stdout;

/// Show what the air is made of: profiles, optical depths, phase functions
#[derive(Debug, Args)]
#[command(
    allow_negative_numbers = true,
    after_help = "\
Prints tables of optical depth by species, of the aerosol's albedo, asymmetry, Angstrom exponent and phase function, and of
profiles. -o air.svg draws them; -o air.nc holds everything with CF names; -o air.csv one number a line.

Examples:
  celaje atmosphere --at 41.65,-0.88 --time 2026-06-21T18:30Z
  celaje atmosphere --sun-elevation 30 --aerosol desert --aod 0.4 -o dust.svg -o dust.nc"
)]
pub struct AtmosphereArgs {
    /// Scene file (TOML) with the words of these options; options given here win
    #[arg(value_name = "SCENE.toml")]
    scene: Option<PathBuf>,
    #[command(flatten)]
    where_when: WhereWhen,
    #[command(flatten)]
    air: Air,
    /// Vacuum wavelengths, nm, 280 to 2500: START:STOP:STEP or a list such as 450,550,650
    #[arg(
        long,
        value_name = "NM",
        default_value = "380:780:5",
        help_heading = "View"
    )]
    wavelengths: String,
    /// File to write as well: .svg, .nc or .csv; may be given several times
    #[arg(short, long, value_name = "FILE", help_heading = "Output")]
    output: Vec<PathBuf>,
    /// Print JSON instead of tables: everything but the phase functions and profiles of coefficients
    #[arg(long, help_heading = "Output")]
    json: bool,
}

/// Altitudes of the printed profiles, above sea level \[km\].
const PRINTED_KM: [f64; 17] = [
    0.5, 1.0, 1.5, 2.0, 3.0, 4.0, 6.0, 8.0, 10.0, 12.0, 15.0, 20.0, 25.0, 30.0, 40.0, 50.0, 80.0,
];
/// At most so many wavelengths are printed.
const PRINTED_WAVELENGTHS: usize = 9;

/// Checks everything, takes the air apart, prints, writes every file.
pub fn run(args: &AtmosphereArgs) -> Result<(), Failure> {
    let mut conditions = args.where_when.conditions(&args.air)?;
    let wavelength = wavelengths(Some(&args.wavelengths))?;
    check_outputs(&args.output)?;
    interrupt::set_targets(&args.output);

    let aerosol = AerosolType::of_conditions(&conditions)?;
    let composition = Composition::new(&mut conditions, &aerosol, &wavelength)?;
    let inventory = Inventory::new(&composition, &wavelength)?;
    let metadata = condition_entries(&conditions);
    for path in &args.output {
        interrupt::check()?;
        inventory.save(path, &metadata)?;
    }
    if args.json {
        write_stdout(&json_text(&inventory)?)?;
    } else {
        write_stdout(&tables(&inventory))?;
    }
    if inventory.extrapolated {
        eprintln!(
            "note: a refractive index was extrapolated below the first wavelength of its table"
        );
    }
    Ok(())
}

fn check_outputs(paths: &[PathBuf]) -> Result<(), Failure> {
    for (i, path) in paths.iter().enumerate() {
        InventoryFormat::of(path).map_err(|e| Failure::from(e).into_usage())?;
        if paths[..i].contains(path) {
            return Err(Failure::usage(
                format!("{} is given twice", path.display()),
                "give each file once",
            ));
        }
    }
    for path in paths {
        InventoryFormat::check(path)?;
    }
    Ok(())
}

/// The printed tables.
fn tables(inventory: &Inventory) -> String {
    let present: Vec<&Species> = inventory.species.iter().filter(|s| is_present(s)).collect();
    [
        depth_table(inventory, &present),
        aerosol_table(inventory),
        profile_table(inventory, &present),
    ]
    .join("\n")
}

/// Whether there is anything of a species; gases that do nothing are left out.
fn is_present(species: &Species) -> bool {
    species.tau().iter().any(|tau| *tau > 0.0)
}

/// Indices of the printed wavelengths, spread evenly, the last one always among them.
fn printed_wavelengths(inventory: &Inventory) -> Vec<usize> {
    let n = inventory.wavelength_nm.len();
    let stride = (n - 1).div_ceil(PRINTED_WAVELENGTHS - 1).max(1);
    (0..n)
        .filter(|i| (n - 1 - i).is_multiple_of(stride))
        .collect()
}

fn depth_table(inventory: &Inventory, present: &[&Species]) -> String {
    let mut header = vec!["nm".to_owned()];
    header.extend(present.iter().map(|s| s.name.clone()));
    header.push("total".to_owned());
    let depths: Vec<Vec<f64>> = present.iter().map(|s| s.tau()).collect();
    let total = inventory.tau();
    let row = |i: usize| {
        let mut cells = vec![inventory.wavelength_nm[i].to_string()];
        cells.extend(depths.iter().map(|tau| number(tau[i])));
        cells.push(number(total[i]));
        cells
    };
    let rows = printed_wavelengths(inventory).into_iter().map(row);
    format!(
        "Vertical optical depth, ground to space\n{}",
        aligned(header, rows)
    )
}

fn aerosol_table(inventory: &Inventory) -> String {
    let header = [
        "nm",
        "depth",
        "albedo",
        "asymmetry",
        "exponent",
        "p(0)",
        "p(90)",
        "p(180)",
    ];
    let sum = &inventory.aerosol;
    let t = inventory.theta_deg.len();
    // The angles are symmetric about the one in the middle, 90°.
    let row = |i: usize| {
        let phase = &sum.phase[i * t..(i + 1) * t];
        let fixed = |v: f64| {
            if v.is_nan() {
                "-".to_owned()
            } else {
                format!("{v:.3}")
            }
        };
        vec![
            inventory.wavelength_nm[i].to_string(),
            number(sum.tau[i]),
            fixed(sum.ssa[i]),
            fixed(sum.asymmetry[i]),
            fixed(sum.angstrom[i]),
            number(phase[0]),
            number(phase[t / 2]),
            number(phase[t - 1]),
        ]
    };
    let rows = printed_wavelengths(inventory).into_iter().map(row);
    let header = header.map(str::to_owned).to_vec();
    format!(
        "All aerosol of the column; phase function p in 1/sr\n{}",
        aligned(header, rows)
    )
}

fn profile_table(inventory: &Inventory, present: &[&Species]) -> String {
    let green = inventory.nearest_wavelength(550.0);
    let w = inventory.wavelength_nm.len();
    let mut header = ["km", "K", "hPa"].map(str::to_owned).to_vec();
    header.extend(present.iter().map(|s| s.name.clone()));
    let row = |i: usize| {
        let mut cells = vec![
            format!("{:.2}", inventory.altitude_m[i] * 1e-3),
            format!("{:.1}", inventory.temperature_k[i]),
            number(inventory.pressure_pa[i] * 1e-2),
        ];
        let sigma = |s: &&Species| s.sigma_s[i * w + green] + s.sigma_a[i * w + green];
        cells.extend(present.iter().map(|s| number(1e3 * sigma(s))));
        cells
    };
    let rows = printed_altitudes(inventory).into_iter().map(row);
    format!(
        "Extinction at {} nm, 1/km\n{}",
        inventory.wavelength_nm[green],
        aligned(header, rows)
    )
}

/// The ground, and the nodes nearest to round altitudes above it.
fn printed_altitudes(inventory: &Inventory) -> Vec<usize> {
    let z = &inventory.altitude_m;
    let above = PRINTED_KM.iter().filter(|km| **km * 1e3 > z[0] + 100.0);
    let nearest = |km: &f64| {
        let at = z.partition_point(|z| *z < km * 1e3).min(z.len() - 1);
        let below = at.saturating_sub(1);
        if km * 1e3 - z[below] < z[at] - km * 1e3 {
            below
        } else {
            at
        }
    };
    let mut nodes = vec![0];
    nodes.extend(above.map(nearest));
    nodes.dedup();
    nodes
}

/// Four digits that count, in as little room as that takes.
fn number(value: f64) -> String {
    if value.is_nan() {
        "-".to_owned()
    } else if value == 0.0 {
        "0".to_owned()
    } else if (1e-3..1e4).contains(&value.abs()) {
        let digits = (3.0 - value.abs().log10().floor()).clamp(0.0, 6.0) as usize;
        format!("{value:.digits$}")
    } else {
        format!("{value:.2e}")
    }
}

/// Columns as wide as they need to be, numbers to the right.
fn aligned(header: Vec<String>, rows: impl Iterator<Item = Vec<String>>) -> String {
    let mut lines = vec![header];
    lines.extend(rows);
    let width = |c: usize| {
        lines
            .iter()
            .map(|l| l[c].chars().count())
            .max()
            .unwrap_or(0)
    };
    let widths: Vec<usize> = (0..lines[0].len()).map(width).collect();
    let mut text = String::new();
    for line in &lines {
        let cells: Vec<String> = line
            .iter()
            .zip(&widths)
            .map(|(cell, width)| format!("{cell:>width$}"))
            .collect();
        // Writing to a string cannot fail.
        let _ = writeln!(text, "{}", cells.join("  "));
    }
    text
}

/// Numbers of the columns and profiles; what is not a number is null.
fn json_text(inventory: &Inventory) -> Result<String, Failure> {
    let species: Vec<Value> = inventory
        .species
        .iter()
        .map(|s| {
            json!({
                "name": s.name,
                "is_aerosol": s.is_aerosol,
                "number_density_m3": s.number_density,
                "scattering_optical_depth": s.tau_s,
                "absorption_optical_depth": s.tau_a,
            })
        })
        .collect();
    let sum = &inventory.aerosol;
    let object = json!({
        "wavelength_nm": inventory.wavelength_nm,
        "altitude_m": inventory.altitude_m,
        "temperature_k": inventory.temperature_k,
        "pressure_pa": inventory.pressure_pa,
        "species": species,
        "aerosol": {
            "optical_depth": sum.tau,
            "single_scattering_albedo": sum.ssa,
            "asymmetry": sum.asymmetry,
            "angstrom_exponent": sum.angstrom,
        },
        "extrapolated": inventory.extrapolated,
    });
    let text = serde_json::to_string_pretty(&object)
        .map_err(|e| Failure::own_mistake(format!("no JSON: {e}")))?;
    Ok(text + "\n")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_keep_four_digits() {
        let printed = [0.097_21, 0.5, 1234.5, 12_345.0, 1e-5, 0.0, f64::NAN].map(number);
        assert_eq!(
            printed,
            ["0.09721", "0.5000", "1234", "1.23e4", "1.00e-5", "0", "-"]
        );
    }

    #[test]
    fn columns_are_aligned() {
        let rows = [vec!["1".to_owned(), "20.5".to_owned()]];
        let text = aligned(vec!["nm".to_owned(), "a".to_owned()], rows.into_iter());
        assert_eq!(text, "nm     a\n 1  20.5\n");
    }
}
