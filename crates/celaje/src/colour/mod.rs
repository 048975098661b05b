//! Spectral radiance → XYZ → linear sRGB, and tone curves.
