//! Scene files: options in TOML, with the words of the command line.
//!
//! ```toml
//! at = [41.65, -0.88]
//! time = 2026-06-21T18:30:00Z
//! aerosol = "desert"
//! aod = 0.3
//! output = ["sky.png", "sky.exr"]
//! ```
//!
//! Each word becomes the option of that name and goes through the same checks. What the command line says wins, also
//! over words of the scene that answer the same question. A scene may be shared by all commands: words that only
//! another one knows are passed over.

use std::ffi::OsString;
use std::path::PathBuf;

use clap::parser::ValueSource;
use clap::{Arg, ArgAction, ArgMatches, Command};
use toml::Value;

use crate::failure::Failure;
use crate::options::unknown;
use crate::{command, usage_failure};

/// Name of the positional argument of the commands that take a scene.
const SCENE: &str = "scene";
/// Words given on the command line, and those of a scene which they overrule.
const RIVALS: [(&[&str], &[&str]); 4] = [
    (&["at", "time"], &["sun-elevation", "sun-azimuth"]),
    (&["ozone", "ozone-climate"], &["no-ozone"]),
    (&["no-ozone"], &["ozone"]),
    (&["projection"], &["fov", "look"]),
];

/// The arguments with those of the scene file, if one is named among them.
pub fn with_scene(args: &[OsString], matches: ArgMatches) -> Result<ArgMatches, Failure> {
    let Some((name, given)) = matches.subcommand() else {
        return Ok(matches);
    };
    let scene = given.try_get_one::<PathBuf>(SCENE).ok().flatten();
    let Some(path) = scene else {
        return Ok(matches);
    };
    let place = path.display().to_string();
    let text = std::fs::read_to_string(path).map_err(|e| Failure::unreadable(path, &e))?;
    let words = options(&text, name, given).map_err(|f| f.within(&place))?;
    // The program and the command come first.
    let (front, back) = args.split_at(args.len().min(2));
    let all = front.iter().cloned().chain(words).chain(back.to_vec());
    // The command line alone was understood: what is wrong now comes from the scene.
    command()
        .try_get_matches_from(all)
        .map_err(|e| usage_failure(&e).within(&place))
}

/// The scene's words as `--name=value`, without those that the command line overrules.
fn options(text: &str, command: &str, given: &ArgMatches) -> Result<Vec<OsString>, Failure> {
    let table: toml::Table = text.parse().map_err(|e| broken(text, &e))?;
    let cli = crate::command();
    let known: Vec<&Arg> = cli
        .get_subcommands()
        .filter(|c| takes_scene(c))
        .flat_map(Command::get_arguments)
        .filter(|a| a.get_long().is_some_and(|l| l != "help"))
        .collect();
    let here: Vec<&Arg> = cli
        .get_subcommands()
        .filter(|c| c.get_name() == command)
        .flat_map(Command::get_arguments)
        .collect();
    let is_given = |word: &str| {
        here.iter().any(|a| {
            let id = a.get_id().as_str();
            a.get_long() == Some(word) && given.value_source(id) == Some(ValueSource::CommandLine)
        })
    };
    let overruled = |word: &str| {
        RIVALS.iter().any(|(winners, losers)| {
            losers.contains(&word) && winners.iter().any(|winner| is_given(winner))
        })
    };
    let mut words = Vec::new();
    for (key, value) in &table {
        if !known.iter().any(|a| a.get_long() == Some(key)) {
            let mut names: Vec<String> = known
                .iter()
                .filter_map(|a| a.get_long().map(str::to_owned))
                .collect();
            names.sort();
            names.dedup();
            return Err(unknown("word of a scene", key, names));
        }
        let Some(arg) = here.iter().find(|a| a.get_long() == Some(key)) else {
            continue;
        };
        // The files of a scene are pictures.
        if command == "atmosphere" && key == "output" {
            continue;
        }
        if !is_given(key) && !overruled(key) {
            words.extend(option(key, value, arg)?);
        }
    }
    Ok(words)
}

fn takes_scene(command: &Command) -> bool {
    command.get_positionals().any(|a| a.get_id() == SCENE)
}

/// One word as options: none for a switch that is off, several for a list of files.
fn option(key: &str, value: &Value, arg: &Arg) -> Result<Vec<OsString>, Failure> {
    let with = |value: String| OsString::from(format!("--{key}={value}"));
    if matches!(arg.get_action(), ArgAction::SetTrue) {
        return match value {
            Value::Boolean(true) => Ok(vec![format!("--{key}").into()]),
            Value::Boolean(false) => Ok(Vec::new()),
            _ => Err(Failure::usage(
                format!("{key} is neither true nor false"),
                format!("write {key} = true, or leave it out"),
            )),
        };
    }
    let single = |value: &Value| match value {
        Value::String(s) => Ok(s.clone()),
        Value::Integer(i) => Ok(i.to_string()),
        Value::Float(f) => Ok(f.to_string()),
        Value::Datetime(t) => Ok(t.to_string()),
        Value::Boolean(b) => Ok(b.to_string()),
        Value::Array(_) | Value::Table(_) => Err(Failure::usage(
            format!("{key} is a table or a list of lists"),
            "write the words of the command line, one per line: aod = 0.3",
        )),
    };
    match (value, arg.get_action()) {
        (Value::Array(values), ArgAction::Append) => {
            values.iter().map(|v| single(v).map(with)).collect()
        }
        (Value::Array(values), _) => {
            let values: Vec<String> = values.iter().map(single).collect::<Result<_, _>>()?;
            Ok(vec![with(values.join(","))])
        }
        (value, _) => Ok(vec![with(single(value)?)]),
    }
}

fn broken(text: &str, error: &toml::de::Error) -> Failure {
    let before = error
        .span()
        .and_then(|span| text.get(..span.start))
        .unwrap_or("");
    let line = before.matches('\n').count() + 1;
    Failure::usage(
        format!("line {line}: {}", error.message()),
        "a scene is TOML with the words of the command line: aerosol = \"desert\"",
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The options of a scene beside the arguments of `celaje render`.
    fn words(scene: &str, arguments: &[&str]) -> Vec<String> {
        let all = ["celaje", "render"].iter().chain(arguments);
        let matches = command().try_get_matches_from(all).unwrap();
        let (name, given) = matches.subcommand().unwrap();
        let words = options(scene, name, given).unwrap();
        words
            .into_iter()
            .map(|w| w.into_string().unwrap())
            .collect()
    }

    #[test]
    fn every_kind_of_value_becomes_an_option() {
        let scene = "at = [-33.4, -70.6]\ntime = 2026-06-21T18:30:00Z\naod = 0.3\nspp = 4\nno-ozone = true\n\
                     output = ['a.png', 'b.exr']\nalbedo = 'sand'";
        let expected = [
            "--at=-33.4,-70.6",
            "--time=2026-06-21T18:30:00Z",
            "--aod=0.3",
            "--spp=4",
            "--no-ozone",
            "--output=a.png",
            "--output=b.exr",
            "--albedo=sand",
        ];
        let mut got = words(scene, &[]);
        got.sort();
        let mut expected = expected.map(str::to_owned);
        expected.sort();
        assert_eq!(got, expected);
        assert!(words("no-ozone = false", &[]).is_empty());
        assert_eq!(words("aod = nan", &[]), ["--aod=NaN"]);
    }

    #[test]
    fn the_command_line_wins() {
        assert!(words("aod = 0.3", &["--aod", "0.1"]).is_empty());
        assert!(words("output = ['a.png']", &["-o", "b.png"]).is_empty());
        assert!(words("sun-elevation = 3", &["--at", "0,0"]).is_empty());
        assert!(words("no-ozone = true", &["--ozone", "300"]).is_empty());
        assert_eq!(words("spp = 9", &["--aod", "0.1"]), ["--spp=9"]);
    }

    #[test]
    fn words_of_other_commands_are_passed_over() {
        assert!(words("directions = 'd.csv'", &[]).is_empty());
    }
}
