//! Ctrl-C: the work stops within 0.2 s, and no half file is left.
//!
//! Rendering looks at a flag and stops by itself within milliseconds, tidily. Other phases (building the air,
//! compressing a file) do not: there, and if rendering takes too long to stop, the thread of the signal removes the
//! temporary files and ends the process itself. (The system then takes back a large film at some 0.1 s per half GiB.)
//!
//! A signal belongs to the whole process, so this is the one place with global state.

use std::path::PathBuf;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::sync::{Mutex, PoisonError};
use std::time::Duration;

use celaje::image::remove_temporaries;

use crate::failure::{Failure, INTERRUPTED};

/// How long rendering may take to end by itself; the rest of the 0.2 s is the system's.
const GRACE: Duration = Duration::from_millis(60);
/// The grace in force \[ms\].
static GRACE_MS: AtomicU64 = AtomicU64::new(GRACE.as_millis() as u64);

static RAISED: AtomicBool = AtomicBool::new(false);
/// Whether the work of this moment looks at the flag.
static STOPPABLE: AtomicBool = AtomicBool::new(false);
/// Whether somebody has told the user: the work that ended by itself, or the thread of the signal.
static TOLD: AtomicBool = AtomicBool::new(false);
static TARGETS: Mutex<Vec<PathBuf>> = Mutex::new(Vec::new());

/// Listens to Ctrl-C from now on.
pub fn listen() {
    RAISED.store(false, Ordering::SeqCst);
    TOLD.store(false, Ordering::SeqCst);
    STOPPABLE.store(false, Ordering::SeqCst);
    allow(GRACE);
    set_targets(&[]);
    // A second call within a process finds the handler of the first, which is the same; a system without signals
    // does without.
    let _ = ctrlc::set_handler(on_signal);
}

/// Does work that looks at the flag, and is therefore given a little time to end by itself.
pub fn stoppable<T>(work: impl FnOnce(&AtomicBool) -> T) -> T {
    STOPPABLE.store(true, Ordering::SeqCst);
    let result = work(&RAISED);
    STOPPABLE.store(false, Ordering::SeqCst);
    result
}

/// Allows more time, from now on, between Ctrl-C and the end of stoppable work: what is done is to be kept.
pub fn allow(grace: Duration) {
    GRACE_MS.store(grace.as_millis() as u64, Ordering::SeqCst);
}

/// Goes on, unless Ctrl-C was pressed.
pub fn check() -> Result<(), Failure> {
    if RAISED.load(Ordering::SeqCst) {
        return Err(celaje::Error::Interrupted.into());
    }
    Ok(())
}

/// Names the files about to be written, beside which nothing half done must be left.
pub fn set_targets(paths: &[PathBuf]) {
    *TARGETS.lock().unwrap_or_else(PoisonError::into_inner) = paths.to_vec();
}

/// Ends a command: `true` if it was interrupted, which is then told once.
pub fn was_raised() -> bool {
    let raised = RAISED.load(Ordering::SeqCst);
    if raised {
        tell();
    }
    raised
}

fn tell() {
    if !TOLD.swap(true, Ordering::SeqCst) {
        eprintln!("error: interrupted");
    }
}

fn on_signal() {
    RAISED.store(true, Ordering::SeqCst);
    if STOPPABLE.load(Ordering::SeqCst) {
        std::thread::sleep(Duration::from_millis(GRACE_MS.load(Ordering::SeqCst)));
    }
    for target in TARGETS
        .lock()
        .unwrap_or_else(PoisonError::into_inner)
        .iter()
    {
        remove_temporaries(target);
    }
    tell();
    std::process::exit(i32::from(INTERRUPTED));
}
