//! Published tables and other codes' results, held against ours.

#[path = "../support/mod.rs"]
mod support;

mod adams_kattawar;
mod peer_scene;
mod polarised_shells;
mod polarised_slabs;
