//! Scattering and absorption coefficients along altitude and wavelength.
