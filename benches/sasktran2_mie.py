"""The first job of ``benches/mie.rs`` by sasktran2: prints processor seconds and the sum that both must have."""

import time

import numpy as np
from sasktran2.mie import LinearizedMie

mie = LinearizedMie()
radii_um = 0.01 * 1e3 ** (np.arange(200) / 199.0)
cos_theta = np.cos(np.radians(0.1 * np.arange(1801)))


def job() -> tuple[float, float]:
    """Seconds and sum."""
    total = 0.0
    start = time.process_time()
    for nm in np.arange(380.0, 781.0, 5.0):
        x = 2.0 * np.pi * radii_um / (nm * 1e-3)
        # Their index is n - ik.
        out = mie.calculate(x, 1.5 - 0.01j, cos_theta)
        total += float(np.sum(out.values.S1[:, 0].real) + np.sum(np.abs(out.values.S2[:, 1800])))
    return time.process_time() - start, total


runs = [job() for _ in range(3)]
print(min(seconds for seconds, _ in runs), runs[0][1])
