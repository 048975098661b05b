//! What is in the air: number densities along altitude.
