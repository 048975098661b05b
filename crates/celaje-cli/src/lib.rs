//! The command line of celaje: `celaje render`, `film`, `bake`, `radiance`, `irradiance`, `explain`, `atmosphere`, `merge`,
//! `list`.
//!
//! [`run`] is the whole command; the program `celaje` and the Python package both call it. Data go to stdout and
//! into files, everything else to stderr. Everything that a user can get wrong is checked before any work begins.
//!
//! One file per command; `options` holds what they share, `plan` makes a sky of it, `scene` turns a scene file into options.

mod air;
mod atmosphere;
mod bake;
mod explain;
mod failure;
mod film;
mod interrupt;
mod irradiance;
mod list;
mod merge;
mod options;
mod plan;
mod progress;
mod radiance;
mod render;
mod scene;

use std::ffi::OsString;
use std::io::{self, Write};
use std::panic::{self, AssertUnwindSafe, PanicHookInfo};

use clap::error::ErrorKind;
use clap::{ArgMatches, CommandFactory, FromArgMatches, Parser, Subcommand};

use failure::{Failure, DONE, FAILED, INTERRUPTED};

/// Spectral radiance of the whole sky, from a place and a time
#[derive(Debug, Parser)]
#[command(name = "celaje", version, after_help = AFTER_HELP, arg_required_else_help = true)]
struct Cli {
    #[command(subcommand)]
    command: Command,
}

const AFTER_HELP: &str = "\
Example:
  celaje render --at 41.65,-0.88 --time 2026-06-21T18:30Z -o sky.png -o sky.exr

Where a default is 'climate', celaje finds a value for place and time: 'celaje explain' shows it, and why.
Exit codes: 0 done, 1 failed, 2 bad usage, 130 interrupted.";

#[derive(Debug, Subcommand)]
enum Command {
    Render(render::RenderArgs),
    Film(film::FilmArgs),
    Bake(bake::BakeArgs),
    Radiance(radiance::RadianceArgs),
    Irradiance(irradiance::IrradianceArgs),
    Explain(explain::ExplainArgs),
    Atmosphere(atmosphere::AtmosphereArgs),
    Merge(merge::MergeArgs),
    List(list::ListArgs),
}

/// Options of a command that it refuses, for they belong to methods that it does not use. Helps leave them out.
const OUT_OF_PLACE: [(&str, &[&str]); 2] = [
    ("film", &["method", "spp", "noise", "time_limit", "seed"]),
    ("irradiance", &["noise", "time_limit"]),
];

/// The command with its options.
fn command() -> clap::Command {
    OUT_OF_PLACE
        .iter()
        .fold(Cli::command(), |cli, (name, options)| {
            cli.mut_subcommand(name, |command| {
                let hidden = options.iter();
                hidden.fold(command, |c, option| c.mut_arg(option, |arg| arg.hide(true)))
            })
        })
}

/// Runs the command `celaje` with its arguments, the first of which is the name of the program; returns the exit code.
///
/// 0 done, 1 failed, 2 bad usage, 130 interrupted. Listens to Ctrl-C, for the rest of the life of the process: if work is
/// interrupted that cannot stop by itself in time, the process ends.
pub fn run<I, T>(args: I) -> u8
where
    I: IntoIterator<Item = T>,
    T: Into<OsString>,
{
    let args: Vec<OsString> = args.into_iter().map(Into::into).collect();
    interrupt::listen();
    let hook = panic::take_hook();
    panic::set_hook(Box::new(report_panic));
    let outcome = panic::catch_unwind(AssertUnwindSafe(|| dispatch(&args)));
    panic::set_hook(hook);
    if interrupt::was_raised() {
        return INTERRUPTED;
    }
    match outcome {
        Ok(Ok(())) => DONE,
        Ok(Err(failure)) => {
            failure.report();
            failure.exit
        }
        // Told by the hook.
        Err(_) => FAILED,
    }
}

fn dispatch(args: &[OsString]) -> Result<(), Failure> {
    let matches = match parse(args)? {
        Some(matches) => scene::with_scene(args, matches)?,
        None => return Ok(()),
    };
    let cli = Cli::from_arg_matches(&matches).map_err(|e| usage_failure(&e))?;
    match cli.command {
        Command::Render(args) => render::run(&args),
        Command::Bake(args) => bake::run(&args),
        Command::Film(args) => film::run(&args),
        Command::Radiance(args) => radiance::run(&args),
        Command::Irradiance(args) => irradiance::run(&args),
        Command::Explain(args) => explain::run(&args),
        Command::Atmosphere(args) => atmosphere::run(&args),
        Command::Merge(args) => merge::run(&args),
        Command::List(args) => list::run(&args),
    }
}

/// The arguments understood, or none if help or the version was asked for and given.
fn parse(args: &[OsString]) -> Result<Option<ArgMatches>, Failure> {
    match command().try_get_matches_from(args) {
        Ok(matches) => Ok(Some(matches)),
        Err(e) => match e.kind() {
            ErrorKind::DisplayHelp | ErrorKind::DisplayVersion => {
                write_stdout(&e.render().to_string())?;
                Ok(None)
            }
            _ => Err(usage_failure(&e)),
        },
    }
}

/// clap's error in our form. Its text is `error: …`, perhaps with indented lines, then paragraphs of tips and usage.
fn usage_failure(error: &clap::Error) -> Failure {
    if error.kind() == ErrorKind::DisplayHelpOnMissingArgumentOrSubcommand {
        return Failure::usage(
            "no command given",
            "try 'celaje render --sun-elevation 30 -o sky.png', or 'celaje --help' for all commands",
        );
    }
    let text = error.render().to_string();
    let mut lines = text.lines();
    let message: Vec<&str> = lines
        .by_ref()
        .map(str::trim)
        .take_while(|line| !line.is_empty())
        .collect();
    let message = message.join(" ");
    let message = message
        .strip_prefix("error: ")
        .unwrap_or(&message)
        .replace("invalid float literal", "not a number")
        .replace("invalid digit found in string", "not a whole number");
    let otherwise = match error.kind() {
        ErrorKind::ValueValidation => {
            "'celaje COMMAND --help' tells what every option takes, and its unit"
        }
        _ => "'celaje --help' tells the commands, 'celaje COMMAND --help' their options",
    };
    let hint = lines
        .filter_map(|line| line.trim().strip_prefix("tip: "))
        .find(|tip| !tip.starts_with("to pass"))
        .unwrap_or(otherwise);
    Failure::usage(message, hint)
}

/// A panic is always a mistake of ours: it is told as one, wherever it happened.
fn report_panic(info: &PanicHookInfo<'_>) {
    own_mistake(info).report();
}

fn own_mistake(info: &PanicHookInfo<'_>) -> Failure {
    let payload = info.payload();
    let text = payload.downcast_ref::<&str>().copied();
    let what = text
        .or_else(|| payload.downcast_ref::<String>().map(String::as_str))
        .unwrap_or("something unexpected happened");
    let place = info.location().map_or_else(
        || "somewhere".to_owned(),
        |l| format!("{}:{}", l.file(), l.line()),
    );
    Failure::own_mistake(format!("{what} at {place}"))
}

/// Writes data. A reader who has seen enough, such as `head`, is no error.
fn write_stdout(text: &str) -> Result<(), Failure> {
    let mut stdout = io::stdout().lock();
    match stdout
        .write_all(text.as_bytes())
        .and_then(|()| stdout.flush())
    {
        Err(e) if e.kind() != io::ErrorKind::BrokenPipe => Err(Failure::output(&e)),
        _ => Ok(()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_options_are_consistent() {
        command().debug_assert();
    }

    #[test]
    fn a_panic_is_told_as_a_mistake_of_ours() {
        let (send, receive) = std::sync::mpsc::channel();
        let hook = panic::take_hook();
        panic::set_hook(Box::new(move |info| {
            let _ = send.send(format!("{:?}", own_mistake(info)));
        }));
        let outcome = panic::catch_unwind(|| panic!("seven is {}", 8));
        panic::set_hook(hook);
        assert!(outcome.is_err());
        let told = receive.recv().unwrap();
        for part in [
            "seven is 8 at ",
            "lib.rs:",
            "itself",
            "please report",
            "exit: 1",
        ] {
            assert!(told.contains(part), "{told}");
        }
    }

    #[test]
    fn every_option_has_a_heading_and_one_line_of_meaning() {
        for command in command().get_subcommands() {
            for arg in command.get_arguments().filter(|a| !a.is_positional()) {
                let id = arg.get_id();
                let help = arg.get_help().map(ToString::to_string).unwrap_or_default();
                assert!(!help.is_empty() && !help.contains('\n'), "{id}: '{help}'");
                assert!(arg.get_help_heading().is_some(), "{id}");
            }
        }
    }
}
