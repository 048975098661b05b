//! From the library's errors to the exceptions of `celaje._errors`.

use numpy::AsSliceError;
use pyo3::import_exception;
use pyo3::PyErr;

import_exception!(celaje._errors, OutOfRangeError);
import_exception!(celaje._errors, ShapeMismatchError);
import_exception!(celaje._errors, UnknownNameError);
import_exception!(celaje._errors, InvalidInputError);
import_exception!(celaje._errors, TooLargeError);
import_exception!(celaje._errors, FileError);
import_exception!(celaje._errors, CelajeError);

/// A failure of the library, or one of Python itself (a signal, a wrong type).
#[derive(Debug)]
pub enum Failure {
    /// Of the library.
    Core(celaje::Error),
    /// Of Python.
    Python(PyErr),
}

/// What every function of the module returns.
pub type Outcome<T> = Result<T, Failure>;

impl From<celaje::Error> for Failure {
    fn from(error: celaje::Error) -> Self {
        Self::Core(error)
    }
}

impl From<PyErr> for Failure {
    fn from(error: PyErr) -> Self {
        Self::Python(error)
    }
}

impl From<AsSliceError> for Failure {
    fn from(error: AsSliceError) -> Self {
        Self::Python(error.into())
    }
}

impl From<Failure> for PyErr {
    fn from(failure: Failure) -> Self {
        match failure {
            Failure::Core(error) => exception(error),
            Failure::Python(error) => error,
        }
    }
}

fn exception(error: celaje::Error) -> PyErr {
    use celaje::Error as E;
    let (message, hint) = (error.to_string(), error.hint());
    match error {
        E::OutOfRange {
            name,
            value,
            unit,
            range,
            ..
        } => OutOfRangeError::new_err((message, hint, name, value, unit, range)),
        E::ShapeMismatch { .. } => ShapeMismatchError::new_err((message, hint)),
        E::UnknownName { name, known, .. } => {
            UnknownNameError::new_err((message, hint, name, known))
        }
        E::Invalid { .. } => InvalidInputError::new_err((message, hint)),
        E::TooLarge { .. } => TooLargeError::new_err((message, hint)),
        E::File { .. } => FileError::new_err((message, hint)),
        _ => CelajeError::new_err((message, hint)),
    }
}
