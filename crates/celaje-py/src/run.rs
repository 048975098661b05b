//! Long work without the interpreter's lock, stopped by Ctrl-C.

use std::panic::resume_unwind;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{channel, RecvTimeoutError};
use std::thread;
use std::time::Duration;

use pyo3::{PyErr, Python};

use crate::error::Outcome;

/// Time between two looks at the signals.
const POLL: Duration = Duration::from_millis(50);

/// Largest number of threads that may be asked for.
const MAX_THREADS: usize = 1024;

/// Runs `work` in a thread of its own and, every 50 ms, lets Python handle its signals.
///
/// A signal whose handler raises (Ctrl-C) sets the flag that `work` is given; its exception is then returned.
///
/// `threads` — size of a thread pool made for this work; `None` takes the one that all work shares.
pub fn interruptible<T: Send>(
    py: Python<'_>,
    threads: Option<usize>,
    work: impl FnOnce(&AtomicBool) -> celaje::Result<T> + Send,
) -> Outcome<T> {
    let pool = threads.map(pool_of).transpose()?;
    let cancel = AtomicBool::new(false);
    let (result, signal) = py.detach(|| {
        thread::scope(|scope| {
            let (alive, finished) = channel::<()>();
            let cancel = &cancel;
            let worker = scope.spawn(move || {
                // Dropped at the end, whichever way the work ends: that is the message.
                let _alive = alive;
                match pool {
                    Some(pool) => pool.install(|| work(cancel)),
                    None => work(cancel),
                }
            });
            let mut signal: Option<PyErr> = None;
            while finished.recv_timeout(POLL) == Err(RecvTimeoutError::Timeout) {
                if signal.is_none() {
                    signal = Python::attach(|py| py.check_signals()).err();
                    cancel.store(signal.is_some(), Ordering::Relaxed);
                }
            }
            (worker.join().unwrap_or_else(|p| resume_unwind(p)), signal)
        })
    });
    match signal {
        Some(raised) => Err(raised.into()),
        None => Ok(result?),
    }
}

fn pool_of(threads: usize) -> celaje::Result<rayon::ThreadPool> {
    let range = 1.0..=MAX_THREADS as f64;
    celaje::error::check_range("threads", threads as f64, "", range)?;
    let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build();
    pool.map_err(|e| {
        celaje::Error::invalid(
            format!("{threads} threads cannot be started: {e}"),
            "ask for fewer threads",
        )
    })
}
