//! `celaje explain`: every condition in force, and why.

use std::path::PathBuf;

use celaje::climate::{ConditionRow, Conditions};
use clap::Args;
use serde_json::{json, Map, Value};

use crate::failure::Failure;
use crate::options::{Air, WhereWhen};
use crate::write_stdout;

/// Show every condition in force, and why
#[derive(Debug, Args)]
#[command(
    allow_negative_numbers = true,
    after_help = "\
Example:
  celaje explain --at 41.65,-0.88 --time 2026-06-21T18:30Z"
)]
pub struct ExplainArgs {
    /// Scene file (TOML) with the words of these options; options given here win
    #[arg(value_name = "SCENE.toml")]
    scene: Option<PathBuf>,
    #[command(flatten)]
    where_when: WhereWhen,
    #[command(flatten)]
    air: Air,
    /// Write JSON: value, unit, uncertainty, source and reason of every condition, and what stands behind them
    #[arg(long, help_heading = "Output")]
    json: bool,
}

/// Below this elevation of the sun no sunlight is left in the sky \[deg\].
const NIGHT_DEG: f64 = -18.0;

/// Prints the conditions.
pub fn run(args: &ExplainArgs) -> Result<(), Failure> {
    let conditions = args.where_when.conditions(&args.air)?;
    if args.json {
        write_stdout(&json_text(&conditions)?)?;
    } else {
        write_stdout(&table(&conditions.rows()))?;
    }
    if let Some(note) = night(&conditions) {
        eprintln!("{note}");
    }
    Ok(())
}

/// What to expect of a sky without sunlight.
pub fn night(conditions: &Conditions) -> Option<String> {
    let elevation_deg = conditions.sun_elevation_deg.value;
    (elevation_deg < NIGHT_DEG).then(|| {
        format!(
            "note: the sun is {:.1} degrees below the horizon and lights nothing; moon, stars and airglow are not \
             built in, so this sky is black",
            -elevation_deg
        )
    })
}

/// Aligned columns: name, value, its standard deviation, unit, reason with its source.
fn table(rows: &[ConditionRow]) -> String {
    let mut lines = vec![["CONDITION", "VALUE", "±", "UNIT", "REASON [SOURCE]"].map(str::to_owned)];
    lines.extend(rows.iter().map(|row| {
        let c = &row.condition;
        let reason = format!("{} [{}]", c.reason, c.source);
        let spread = c.uncertainty.map_or(String::new(), two_digits);
        [
            row.key.to_owned(),
            row.text.clone(),
            spread,
            c.unit.to_owned(),
            reason,
        ]
    }));
    let width = |i: usize| {
        lines
            .iter()
            .map(|l| l[i].chars().count())
            .fold(0, usize::max)
    };
    let [key, value, spread, unit] = [0, 1, 2, 3].map(width);
    let mut text = String::new();
    for [k, v, s, u, reason] in &lines {
        text.push_str(&format!(
            "{k:key$}  {v:>value$}  {s:>spread$}  {u:unit$}  {reason}\n"
        ));
    }
    text
}

/// A positive number to two digits.
fn two_digits(value: f64) -> String {
    let digits = if value > 0.0 {
        1 - value.log10().floor() as i32
    } else {
        0
    };
    let places = usize::try_from(digits).unwrap_or(0);
    format!("{value:.places$}")
}

/// An object with an object for every condition, in the order of the table; what stands behind them is in `details`.
fn json_text(conditions: &Conditions) -> Result<String, Failure> {
    let broken = |e: serde_json::Error| Failure::own_mistake(format!("no JSON: {e}"));
    let mut object = Map::new();
    for row in conditions.rows() {
        let condition = serde_json::to_value(row.condition).map_err(broken)?;
        object.insert(row.key.to_owned(), condition);
    }
    let details = json!({
        "atmosphere_blend": conditions.atmosphere_blend,
        "aerosol_mixture": conditions.mixture,
        "ground": conditions.ground,
    });
    object.insert("details".to_owned(), details);
    let text = serde_json::to_string_pretty(&Value::Object(object)).map_err(broken)?;
    Ok(text + "\n")
}
