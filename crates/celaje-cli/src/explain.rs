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
    /// Write JSON: value, unit, source and reason of every condition
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

/// Aligned columns: name, value, unit, reason with its source.
fn table(rows: &[ConditionRow]) -> String {
    let width = |column: fn(&ConditionRow) -> &str, title: &str| {
        let cells = rows.iter().map(|r| column(r).chars().count());
        cells.fold(title.len(), usize::max)
    };
    let key = width(|r| r.key, "CONDITION");
    let value = width(|r| &r.value, "VALUE");
    let unit = width(|r| r.unit, "UNIT");
    let mut text = format!(
        "{:key$}  {:>value$}  {:unit$}  REASON [SOURCE]\n",
        "CONDITION", "VALUE", "UNIT"
    );
    for r in rows {
        text.push_str(&format!(
            "{:key$}  {:>value$}  {:unit$}  {} [{}]\n",
            r.key, r.value, r.unit, r.reason, r.source
        ));
    }
    text
}

/// An object with an object for every condition, in the order of the table.
fn json_text(conditions: &Conditions) -> Result<String, Failure> {
    let broken = |e: serde_json::Error| Failure::own_mistake(format!("no JSON: {e}"));
    let mut object = Map::new();
    if let Value::Object(fields) = serde_json::to_value(conditions).map_err(broken)? {
        object.extend(fields.into_iter().filter(|(_, v)| !v.is_null()));
    }
    // What is no condition but a limit of the method, such as refraction.
    for row in conditions.rows() {
        if !object.contains_key(row.key) {
            let entry = json!({
                "value": row.value, "unit": row.unit, "source": row.source, "reason": row.reason
            });
            object.insert(row.key.to_owned(), entry);
        }
    }
    let text = serde_json::to_string_pretty(&Value::Object(object)).map_err(broken)?;
    Ok(text + "\n")
}
