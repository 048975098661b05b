//! Same seed, same bits, on any number of threads.

use celaje::transport::{Classic, Integrator, Path, Tracker};

use crate::scenes::{hazy_air, look, under_sun, PLANET_RADIUS_M};
use crate::support::{batches, Job};

#[test]
fn bits_do_not_depend_on_threads() {
    let medium = hazy_air(0.3, true);
    let scene = under_sun(&medium, 10.0, 0.2, 0.27);
    let looks: Vec<_> = (0..37)
        .map(|i| look(f64::from(i) * 9.7, f64::from(i) * 2.4))
        .collect();
    let job = Job {
        seed: 7,
        batches: 1,
        spp: 64,
        max_order: None,
    };
    let integrators: [&(dyn Integrator<_> + Sync); 3] = [&Path, &Tracker, &Classic];
    for integrator in integrators {
        let with_threads = |n: usize| {
            let pool = rayon::ThreadPoolBuilder::new()
                .num_threads(n)
                .build()
                .unwrap();
            pool.install(|| batches(integrator, &scene, PLANET_RADIUS_M, &looks, job))
        };
        let one = with_threads(1);
        assert_eq!(one, with_threads(2));
        assert_eq!(one, with_threads(16));
        let other_seed = batches(
            integrator,
            &scene,
            PLANET_RADIUS_M,
            &looks,
            Job { seed: 8, ..job },
        );
        assert_ne!(one, other_seed);
    }
}
