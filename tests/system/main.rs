//! Whole skies against closed forms and deterministic integrals.

#[path = "../support/mod.rs"]
mod support;

mod correction;
mod disc;
mod energy;
mod gridded;
mod polarisation;
mod polarised_shells;
mod reproducibility;
mod scenes;
mod shells;
mod shells_exact;
mod single_scattering;
mod unbiased;
mod variants;
mod white_furnace;
