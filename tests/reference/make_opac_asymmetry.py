"""Converged asymmetry of OPAC's components, by miepython.

``python make_opac_asymmetry.py > opac_asymmetry_converged.csv``, some minutes. It covers every row of OPAC's own
table from 0.3 to 2.5 µm whose asymmetry our shipped tables miss by more than 0.0025, or whose extinction by more than
0.4 %: a test can then tell who is right.
"""

import csv
from pathlib import Path

import miepython
import numpy as np

HERE = Path(__file__).parent
DATA = HERE.parents[1] / "data" / "aerosol_opac"
RADII = 30_000


def rows(path: Path) -> list[dict[str, str]]:
    lines = path.read_text(encoding="utf-8").splitlines()
    return list(csv.DictReader(line for line in lines if not line.startswith("#")))


COMPONENTS = rows(DATA / "components.csv")
INDICES = rows(DATA / "refractive_index.csv")
OURS = rows(HERE.parents[1] / "data" / "mie_tables" / "cross_sections.csv")


def pick(table: list[dict[str, str]], **wanted: float | str) -> dict[str, str]:
    def same(cell: str, value: float | str) -> bool:
        return cell == value if isinstance(value, str) else abs(float(cell) - value) < 1e-9

    return next(row for row in table if all(same(row[k], v) for k, v in wanted.items()))


def converged(component: str, humidity: float, wavelength_um: float) -> tuple[float, float]:
    """Extinction per particle [km⁻¹ per cm⁻³] and asymmetry."""
    size = pick(COMPONENTS, component=component, rh_percent=humidity)
    index = pick(INDICES, component=component, rh_percent=humidity, wavelength_um=wavelength_um)
    low, high = float(size["r_min_um"]), float(size["r_max_um"])
    mode, sigma = float(size["r_mod_um"]), float(size["sigma"])
    u = np.linspace(np.log(low), np.log(high), RADII)
    r = np.exp(u)
    number = np.exp(-0.5 * ((u - np.log(mode)) / np.log(sigma)) ** 2)
    number /= np.sqrt(2.0 * np.pi) * np.log(sigma)
    x = 2.0 * np.pi * r / wavelength_um
    m = complex(float(index["n"]), -abs(float(index["k"])))
    q_ext, q_sca, _, g = miepython.efficiencies_mx(m, x)
    area = number * np.pi * r**2
    ext = np.trapezoid(area * q_ext, u)
    sca = np.trapezoid(area * q_sca, u)
    return 1e-3 * ext, np.trapezoid(area * q_sca * g, u) / sca


print(f"""\
# Extinction relative to OPAC's own table, and asymmetry, of OPAC components where the table is not converged.
# source: miepython {miepython.__version__} (efficiencies_mx), trapezoidal rule over {RADII} radii equidistant in ln r
# between the component's bounds, sizes and indices of data/aerosol_opac; made by make_opac_asymmetry.py
component,rh_percent,wavelength_um,ext_over_opac_minus_1,asymmetry_g,asymmetry_g_opac""")
for row in rows(HERE / "opac_component_optics.csv"):
    name, humidity, um = row["component"], float(row["rh_percent"]), float(row["wavelength_um"])
    if not 0.3 <= um <= 2.5:
        continue
    ours = pick(OURS, particle=name, rh_percent=humidity, wavelength_nm=round(1e3 * um, 2))
    theirs_g, theirs_ext = float(row["asymmetry_g"]), float(row["ext_km-1_per_cm-3"])
    off_g = abs(float(ours["asymmetry"]) - theirs_g)
    off_ext = abs(1e9 * float(ours["xs_ext_m2"]) / theirs_ext - 1.0)
    if off_g > 0.0025 or off_ext > 0.004:
        ext, g = converged(name, humidity, um)
        print(
            f"{name},{humidity:g},{um:g},{ext / theirs_ext - 1.0:.5f},{g:.5f},{theirs_g}",
            flush=True,
        )
