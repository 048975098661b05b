//! Solving the radiative transfer equation.
