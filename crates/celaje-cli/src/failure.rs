//! What ends a command early, and how it is told: `error: …`, then `hint: …`, and an exit code.

use std::io;
use std::path::Path;

use celaje::Error;

/// Everything went well.
pub const DONE: u8 = 0;
/// Something went wrong while working: a file, the system, a mistake of our own.
pub const FAILED: u8 = 1;
/// What was asked for makes no sense.
pub const BAD_USAGE: u8 = 2;
/// The user stopped the work.
pub const INTERRUPTED: u8 = 130;

/// Why a command ends without success.
#[derive(Debug)]
pub struct Failure {
    /// Exit code of the process.
    pub exit: u8,
    message: String,
    hint: String,
}

impl Failure {
    /// A mistake in what was asked for.
    pub fn usage(message: impl Into<String>, hint: impl Into<String>) -> Self {
        Self {
            exit: BAD_USAGE,
            message: message.into(),
            hint: hint.into(),
        }
    }

    /// A mistake of the program itself.
    pub fn own_mistake(message: impl Into<String>) -> Self {
        Self {
            exit: FAILED,
            message: format!(
                "{} (a mistake in celaje {} itself)",
                message.into(),
                env!("CARGO_PKG_VERSION")
            ),
            hint: "please report it, with the whole command and this message".to_owned(),
        }
    }

    /// A file, or standard input, that cannot be read.
    pub fn unreadable(path: &Path, error: &io::Error) -> Self {
        Self {
            exit: FAILED,
            message: format!("{}: {error}", path.display()),
            hint: "give the name of a file that exists and is text".to_owned(),
        }
    }

    /// Standard output that does not take what is written.
    pub fn output(error: &io::Error) -> Self {
        Self {
            exit: FAILED,
            message: format!("standard output: {error}"),
            hint: "send it somewhere else".to_owned(),
        }
    }

    /// The same told as a mistake in what was asked for.
    pub fn into_usage(self) -> Self {
        Self {
            exit: BAD_USAGE,
            ..self
        }
    }

    /// Says first where the trouble is: `scene.toml: …`.
    pub fn within(mut self, place: &str) -> Self {
        self.message = format!("{place}: {}", self.message);
        self
    }

    /// Tells the user, on stderr.
    pub fn report(&self) {
        eprintln!("error: {}", self.message);
        if !self.hint.is_empty() {
            eprintln!("hint: {}", self.hint);
        }
    }
}

impl From<Error> for Failure {
    fn from(error: Error) -> Self {
        let exit = match error {
            Error::File { .. } => FAILED,
            Error::Interrupted => INTERRUPTED,
            _ => BAD_USAGE,
        };
        Self {
            exit,
            message: error.to_string(),
            hint: error.hint(),
        }
    }
}
