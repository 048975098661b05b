"""Write the tables of this folder from the Python package colour-science (see SOURCE.md).

pip install colour-science==0.4.7
python data/colour/make.py
"""

from pathlib import Path

from colour import MSDS_CMFS, SDS_ILLUMINANTS

FOLDER = Path(__file__).resolve().parent
CIE_1931 = MSDS_CMFS["CIE 1931 2 Degree Standard Observer"]
CIE_1964 = MSDS_CMFS["CIE 1964 10 Degree Standard Observer"]
D65 = SDS_ILLUMINANTS["D65"]


def write(name, header, rows):
    # colour-science has zbar = -2e-21 at two wavelengths, a rounding residue of CIE's 0.
    lines = [header] + [",".join(f"{max(value, 0.0):.9g}" for value in row) for row in rows]
    (FOLDER / name).write_text("\n".join(lines) + "\n", encoding="ascii")


write(
    "observers_1nm.csv",
    "wavelength_nm,xbar_1931,ybar_1931,zbar_1931,xbar_1964,ybar_1964,zbar_1964",
    [(w, *CIE_1931[w], *CIE_1964[w]) for w in CIE_1931.wavelengths],
)
write("illuminant_d65_5nm.csv", "wavelength_nm,relative_power", zip(D65.wavelengths, D65.values))
