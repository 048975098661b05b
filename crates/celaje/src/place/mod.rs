//! Where and when, and where the sun stands.
