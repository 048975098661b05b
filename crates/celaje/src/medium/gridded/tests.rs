//! The gridded medium against exact transmittance, and what it refuses.

use super::*;
use crate::math::Rng;

const RADIUS_M: f64 = 6_360_000.0;

fn air() -> LayeredMedium {
    let mut air = LayeredMedium::new(&[0.0, 2e3, 2e4, 1e5], &[550.0], RADIUS_M).unwrap();
    let phase = Phase::henyey_greenstein(&[0.0]).unwrap();
    air.add(&[1e-5, 8e-6, 1e-6, 0.0], &[0.0; 4], phase).unwrap();
    air
}

fn edges(n: usize, from: f64, to: f64) -> Vec<f64> {
    (0..=n)
        .map(|i| from + (to - from) * i as f64 / n as f64)
        .collect()
}

/// Cells of random content from 1 to 5 km, 40 km wide; every fourth is empty.
fn clouds() -> GridBox {
    let (x, y, z) = (
        edges(9, -20e3, 25e3),
        edges(6, -15e3, 21e3),
        edges(5, 1e3, 5e3),
    );
    let mut rng = Rng::new(1, 0);
    let density: Vec<f64> = (0..9 * 6 * 5)
        .map(|i| if i % 4 == 0 { 0.0 } else { rng.uniform() })
        .collect();
    let phase = Phase::henyey_greenstein(&[0.8]).unwrap();
    GridBox::new([&x, &y, &z], &density, &[1e-3], &[1e-5], phase).unwrap()
}

fn rays() -> Vec<Ray> {
    let mut rng = Rng::new(2, 0);
    (0..2000)
        .map(|i| {
            // From the ground, from inside the box, from far away in space, in all directions.
            let altitude_m = [0.0, 3e3, 4e5][i % 3];
            let foot = Vec3::new(
                60e3 * (rng.uniform() - 0.5),
                60e3 * (rng.uniform() - 0.5),
                RADIUS_M,
            );
            let origin = foot.normalized() * (RADIUS_M + altitude_m);
            let cos_theta = 2.0 * rng.uniform() - 1.0;
            let turn = std::f64::consts::TAU * rng.uniform();
            let direction = match i % 3 {
                2 => Vec3::new(0.0, 0.0, -1.0).deflected(1.0 - 0.05 * rng.uniform(), turn),
                _ => Vec3::new(0.0, 0.0, 1.0).deflected(cos_theta, turn),
            };
            Ray { origin, direction }
        })
        .collect()
}

/// The pieces cover the span without a gap, and the extinction never exceeds their bound; in blocks of one cell it equals it.
#[test]
fn pieces_cover_the_span_and_bound_the_extinction() {
    let (air, grid) = (air(), clouds());
    let medium = GriddedMedium::new(&air, &grid).unwrap();
    let mut rng = Rng::new(3, 0);
    let mut inside = 0;
    for ray in rays() {
        let Some((span, _)) = ray.through_air(RADIUS_M, RADIUS_M + 1e5) else {
            continue;
        };
        let mut at = span.start_m;
        for piece in medium.segments(&ray, span) {
            assert!(piece.end_m >= at, "{} {at}", piece.end_m);
            for _ in 0..4 {
                let s = at + (piece.end_m - at) * rng.uniform();
                let sigma_t = medium.coefficients_at(0, ray.at(s)).0;
                assert!(sigma_t <= piece.sigma_maj, "{sigma_t} {}", piece.sigma_maj);
                inside += usize::from(medium.density_at(ray.at(s)) > 0.0);
            }
            at = piece.end_m;
        }
        assert_eq!(at, span.end_m);
    }
    assert!(inside > 2000, "{inside}");
}

/// A point in every cell, found again by its indices: planes through the centre, spheres about it.
#[test]
fn a_cell_is_where_its_edges_are() {
    let (air, grid) = (air(), clouds());
    let medium = GriddedMedium::new(&air, &grid).unwrap();
    for z in 0..5 {
        for y in 0..6 {
            for x in 0..9 {
                let middle = |edges: &[f64], i: usize| 0.5 * (edges[i] + edges[i + 1]);
                let foot = Vec3::new(middle(&grid.east_m, x), middle(&grid.north_m, y), RADIUS_M);
                let at = foot.normalized() * (RADIUS_M + middle(&grid.altitude_m, z));
                assert_eq!(medium.density_at(at), grid.density_of([x, y, z]));
                assert_eq!(medium.density_at(at * -1.0), 0.0);
            }
        }
    }
}

#[test]
fn a_box_that_makes_no_sense_is_refused() {
    let phase = || Phase::henyey_greenstein(&[0.8]).unwrap();
    let make = |east: &[f64], density: &[f64], sigma: &[f64]| {
        GridBox::new(
            [east, &[0.0, 1.0], &[0.0, 1.0]],
            density,
            sigma,
            &[0.0],
            phase(),
        )
    };
    assert!(make(&[0.0, 1.0], &[1.0], &[1.0]).is_ok());
    assert!(make(&[0.0], &[], &[1.0]).is_err());
    assert!(make(&[1.0, 0.0], &[1.0], &[1.0]).is_err());
    assert!(make(&[0.0, f64::NAN], &[1.0], &[1.0]).is_err());
    assert!(make(&[0.0, 1.0], &[1.0, 1.0], &[1.0]).is_err());
    assert!(make(&[0.0, 1.0], &[-1.0], &[1.0]).is_err());
    assert!(make(&[0.0, 1.0], &[1.0], &[1.0, 1.0]).is_err());
    let two = Phase::henyey_greenstein(&[0.8; 20]).unwrap();
    let grid = GridBox::new(
        [&[0.0, 1.0], &[0.0, 1.0], &[0.0, 1.0]],
        &[1.0],
        &[1.0; 20],
        &[0.0; 20],
        two,
    );
    assert!(GriddedMedium::new(&air(), &grid.unwrap()).is_err());
}
