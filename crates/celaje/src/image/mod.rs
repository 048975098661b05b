//! Films to files: PNG, EXR, HDR.
