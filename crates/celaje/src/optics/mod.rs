//! How matter and light interact: cross sections and phase functions.
