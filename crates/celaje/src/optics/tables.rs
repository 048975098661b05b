//! Shipped tables of the optics of every kind of particle in the library, so that a sky starts at once.
//!
//! The tables hold cross sections and scattering matrices at [`wavelength_nodes_nm`], [`HUMIDITY_NODES`] and the angles of
//! [`AngleGrid::default`]; `cargo run --release -p celaje --example make_tables` computes them anew.
//!
//! # Between the nodes
//! Refractive indices are linear in wavelength between the rows of their source, so a table has nodes at those rows and
//! one halfway, and interpolation never crosses a row: the parabola in `ln λ` through three nodes, of `ln` extinction, of
//! single-scattering albedo, asymmetry, `ln F11`, and the ratios of the other elements to `F11`; the phase function is
//! normalised again afterwards. In humidity it is the cubic in `ln r` of the mode radius through four nodes on the same
//! side of 50 %. The errors that remain, measured against direct computation, are stated and tested in
//! `tests/reference_tables.rs`.
//!
//! # On disk
//! `cross_sections.csv` is text. `phase.bin` and `polarisation.bin` hold one compressed block per row group of it: a
//! little-endian `u32` length, then a deflated stream of variable-length integers, the differences from the plane through
//! the neighbours below in angle and wavelength. `ln F11` counts in steps of 2⁻¹¹ (an error of 2.4·10⁻⁴ at most), the ratios
//! in steps of 0.002.

use std::io::{Read, Write};

use flate2::{read::DeflateDecoder, write::DeflateEncoder, Compression};

use super::angles::AngleGrid;
use super::lognormal::{particle_optics, ParticleOptics, ScatteringMatrix};
use crate::composition::aerosol::ParticleSource;
use crate::composition::opac;
use crate::error::{check_range, Error, Result};
use crate::math::Table;
use crate::spectrum::WavelengthGrid;

/// Relative humidities of the tables of hygroscopic particles \[%\]: OPAC's eight classes, and three more below 50 %, where
/// drying salt changes most.
pub const HUMIDITY_NODES: [f64; 11] = [
    0.0, 10.0, 20.0, 35.0, 50.0, 70.0, 80.0, 90.0, 95.0, 98.0, 99.0,
];
/// Node at which the interpolation over humidity starts afresh.
const HUMIDITY_BREAK: usize = 4;

/// Wavelengths between which OPAC's refractive indices are linear \[nm\].
const INDEX_ROWS_NM: [f64; 19] = [
    280.0, 300.0, 350.0, 400.0, 450.0, 500.0, 550.0, 600.0, 650.0, 700.0, 750.0, 800.0, 900.0,
    1000.0, 1250.0, 1500.0, 1750.0, 2000.0, 2500.0,
];

/// Step of `ln F11`: an exact binary fraction.
const LOG_STEP: f64 = 1.0 / 2048.0;
/// Step of the ratios of matrix elements.
const RATIO_STEP: f64 = 0.002;

const CROSS_SECTIONS: &str = include_str!("../../../../data/mie_tables/cross_sections.csv");
const PHASE: &[u8] = include_bytes!("../../../../data/mie_tables/phase.bin");
const POLARISATION: &[u8] = include_bytes!("../../../../data/mie_tables/polarisation.bin");

/// Wavelengths of the tables \[nm\]: the rows of the refractive indices and a node halfway (in `ln λ`) between each pair.
pub fn wavelength_nodes_nm() -> Vec<f64> {
    let mut nodes = vec![INDEX_ROWS_NM[0]];
    for pair in INDEX_ROWS_NM.windows(2) {
        // Rounded, so that the text of the table is the wavelength itself.
        nodes.push(((pair[0] * pair[1]).sqrt() * 100.0).round() / 100.0);
        nodes.push(pair[1]);
    }
    nodes
}

/// Optics of one kind of particle at one humidity and all [`wavelength_nodes_nm`].
#[derive(Debug, Clone, PartialEq)]
pub struct ParticleTable {
    /// Name as in [`ParticleSource::table_name`].
    pub particle: String,
    /// Relative humidity \[%\]; 0 for particles that do not care.
    pub humidity_percent: f64,
    /// One per wavelength node.
    pub optics: Vec<ParticleOptics>,
}

/// What the three files of the tables contain.
#[derive(Debug, Clone, PartialEq)]
pub struct EncodedTables {
    /// `cross_sections.csv`.
    pub cross_sections: String,
    /// `phase.bin`.
    pub phase: Vec<u8>,
    /// `polarisation.bin`.
    pub polarisation: Vec<u8>,
}

/// Computes a table by Mie theory, at full quality.
///
/// # Errors
/// As [`ParticleSource::particle`] and [`particle_optics`].
pub fn compute(source: &ParticleSource, humidity_percent: f64) -> Result<ParticleTable> {
    let particle = source.particle(humidity_percent)?;
    let angles = AngleGrid::default();
    let optics = wavelength_nodes_nm()
        .into_iter()
        .map(|nm| {
            let at = particle.index.at(nm)?;
            particle_optics(&particle.size, at.n, at.k, nm, &angles)
        })
        .collect::<Result<_>>()?;
    Ok(ParticleTable {
        particle: source.table_name().unwrap_or_default(),
        humidity_percent,
        optics,
    })
}

/// Humidities at which a kind of particle is tabulated \[%\].
pub fn humidity_nodes(source: &ParticleSource) -> &'static [f64] {
    if source.is_hygroscopic() {
        &HUMIDITY_NODES
    } else {
        &HUMIDITY_NODES[..1]
    }
}

/// Writes tables in the form in which they are shipped.
///
/// # Errors
/// [`Error::Invalid`] if the tables cannot be packed.
pub fn encode(tables: &[ParticleTable]) -> Result<EncodedTables> {
    let mut out = EncodedTables {
        cross_sections: "# Mean cross sections per particle and asymmetry, made by the example make_tables. See SOURCE.md.\n\
                         particle,rh_percent,wavelength_nm,xs_ext_m2,xs_sca_m2,asymmetry\n"
            .to_owned(),
        phase: Vec::new(),
        polarisation: Vec::new(),
    };
    for table in tables {
        for (nm, o) in wavelength_nodes_nm().iter().zip(&table.optics) {
            out.cross_sections += &format!(
                "{},{},{nm},{:.6e},{:.6e},{:.6}\n",
                table.particle, table.humidity_percent, o.xs_ext, o.xs_sca, o.asymmetry
            );
        }
        let rows = |value: &dyn Fn(&ScatteringMatrix, usize) -> f64| -> Vec<Vec<i32>> {
            let row = |o: &ParticleOptics| {
                let angles = 0..o.matrix.f11.len();
                angles.map(|i| value(&o.matrix, i).round() as i32).collect()
            };
            table.optics.iter().map(row).collect()
        };
        let f11 = rows(&|m, i| m.f11[i].ln() / LOG_STEP);
        push_block(&mut out.phase, &[f11])?;
        let ratios = [
            rows(&|m, i| m.f12[i] / m.f11[i] / RATIO_STEP),
            rows(&|m, i| m.f33[i] / m.f11[i] / RATIO_STEP),
            rows(&|m, i| m.f34[i] / m.f11[i] / RATIO_STEP),
        ];
        push_block(&mut out.polarisation, &ratios)?;
    }
    Ok(out)
}

/// Appends a compressed block.
fn push_block(out: &mut Vec<u8>, planes: &[Vec<Vec<i32>>]) -> Result<()> {
    let mut bytes = Vec::new();
    for rows in planes {
        for w in 0..rows.len() {
            for i in 0..rows[w].len() {
                push_integer(&mut bytes, rows[w][i].wrapping_sub(predicted(rows, w, i)));
            }
        }
    }
    let mut encoder = DeflateEncoder::new(Vec::new(), Compression::best());
    encoder.write_all(&bytes).map_err(|_| damaged())?;
    let packed = encoder.finish().map_err(|_| damaged())?;
    out.extend((packed.len() as u32).to_le_bytes());
    out.extend(packed);
    Ok(())
}

/// A row's value as the plane through its neighbours below has it.
fn predicted(rows: &[Vec<i32>], w: usize, i: usize) -> i32 {
    match (w, i) {
        (0, 0) => 0,
        (0, _) => rows[0][i - 1],
        (_, 0) => rows[w - 1][0],
        // Damaged data must not overflow.
        _ => rows[w][i - 1]
            .wrapping_add(rows[w - 1][i])
            .wrapping_sub(rows[w - 1][i - 1]),
    }
}

/// An integer in as few bytes as it needs, seven bits each, small ones of either sign first.
fn push_integer(bytes: &mut Vec<u8>, value: i32) {
    let mut rest = ((value << 1) ^ (value >> 31)) as u32;
    while rest >= 0x80 {
        bytes.push(rest as u8 | 0x80);
        rest >>= 7;
    }
    bytes.push(rest as u8);
}

fn pop_integer(bytes: &mut impl Iterator<Item = u8>) -> Result<i32> {
    let (mut value, mut shift) = (0u32, 0);
    loop {
        let byte = bytes.next().filter(|_| shift < 32).ok_or_else(damaged)?;
        value |= u32::from(byte & 0x7f) << shift;
        shift += 7;
        if byte < 0x80 {
            return Ok((value >> 1) as i32 ^ -((value & 1) as i32));
        }
    }
}

fn damaged() -> Error {
    Error::invalid(
        "the embedded tables of particles are damaged",
        "build the program again from a fresh copy",
    )
}

/// Reads a block's planes, each of `rows` rows of `columns` values.
fn read_block(file: &[u8], block: usize, planes: usize, size: (usize, usize)) -> Result<Vec<f64>> {
    let mut rest = file;
    for _ in 0..block {
        rest = split_block(rest)?.1;
    }
    let mut bytes = Vec::new();
    let packed = split_block(rest)?.0;
    DeflateDecoder::new(packed)
        .read_to_end(&mut bytes)
        .map_err(|_| damaged())?;
    let mut bytes = bytes.into_iter();
    let mut values = Vec::with_capacity(planes * size.0 * size.1);
    for _ in 0..planes {
        let mut rows: Vec<Vec<i32>> = Vec::with_capacity(size.0);
        for w in 0..size.0 {
            rows.push(Vec::with_capacity(size.1));
            for i in 0..size.1 {
                let value = predicted(&rows, w, i).wrapping_add(pop_integer(&mut bytes)?);
                rows[w].push(value);
            }
        }
        values.extend(rows.into_iter().flatten().map(f64::from));
    }
    Ok(values)
}

/// A block's packed bytes, and what follows it.
fn split_block(file: &[u8]) -> Result<(&[u8], &[u8])> {
    let (length, rest) = file.split_first_chunk::<4>().ok_or_else(damaged)?;
    let length = u32::from_le_bytes(*length) as usize;
    rest.split_at_checked(length).ok_or_else(damaged)
}

/// Columns that are interpolated, at every wavelength node (and angle).
struct Columns {
    ln_ext: Vec<f64>,
    ssa: Vec<f64>,
    asymmetry: Vec<f64>,
    ln_f11: Vec<f64>,
    /// F12, F33 and F34 over F11, one after the other.
    ratios: Vec<f64>,
}

impl Columns {
    /// As shipped, at a humidity node.
    fn shipped(particle: &str, humidity_percent: f64) -> Result<Self> {
        let wavelengths = 2 * INDEX_ROWS_NM.len() - 1;
        let angles = AngleGrid::default().theta_deg().len();
        let prefix = format!("{particle},{humidity_percent},");
        let mut data = CROSS_SECTIONS.lines().skip(2);
        let first = data.position(|line| line.starts_with(&prefix));
        let first = first.ok_or_else(damaged)?;
        let mut text =
            "particle,rh_percent,wavelength_nm,xs_ext_m2,xs_sca_m2,asymmetry\n".to_owned();
        for line in CROSS_SECTIONS.lines().skip(2 + first).take(wavelengths) {
            text += line;
            text.push('\n');
        }
        let table = Table::parse("cross_sections", &text)?;
        let (ext, sca) = (table.numbers("xs_ext_m2")?, table.numbers("xs_sca_m2")?);
        let block = first / wavelengths;
        let mut ln_f11 = read_block(PHASE, block, 1, (wavelengths, angles))?;
        ln_f11.iter_mut().for_each(|v| *v *= LOG_STEP);
        let mut ratios = read_block(POLARISATION, block, 3, (wavelengths, angles))?;
        ratios.iter_mut().for_each(|v| *v *= RATIO_STEP);
        Ok(Self {
            ln_ext: ext.iter().map(|x| x.ln()).collect(),
            ssa: sca.iter().zip(&ext).map(|(s, e)| s / e).collect(),
            asymmetry: table.numbers("asymmetry")?,
            ln_f11,
            ratios,
        })
    }

    /// Between humidity nodes.
    fn at(source: &ParticleSource, particle: &str, humidity_percent: f64) -> Result<Self> {
        let nodes = humidity_nodes(source);
        if let Some(node) = nodes.iter().find(|&&h| h == humidity_percent) {
            return Self::shipped(particle, *node);
        }
        // Four nodes around the humidity, on its side of the break.
        let (low, high) = if humidity_percent < nodes[HUMIDITY_BREAK] {
            (0, HUMIDITY_BREAK)
        } else {
            (HUMIDITY_BREAK, nodes.len() - 1)
        };
        let above = nodes.partition_point(|&h| h < humidity_percent);
        let start = above.saturating_sub(2).clamp(low, high - 3);
        let stencil = &nodes[start..start + 4];
        let size = |h: f64| -> Result<f64> {
            let matter = particle.rsplit('/').next().unwrap_or(particle);
            Ok(opac::component(matter, h)?
                .size
                .mean_square_radius_um2()
                .ln())
        };
        let x = [
            size(stencil[0])?,
            size(stencil[1])?,
            size(stencil[2])?,
            size(stencil[3])?,
        ];
        let weights = lagrange_weights(&x, size(humidity_percent)?);
        let parts = stencil
            .iter()
            .map(|&h| Self::shipped(particle, h))
            .collect::<Result<Vec<_>>>()?;
        let mix = |column: &dyn Fn(&Self) -> &[f64]| -> Vec<f64> {
            let at = |i: usize| {
                weights
                    .iter()
                    .zip(&parts)
                    .map(|(w, p)| w * column(p)[i])
                    .sum()
            };
            (0..column(&parts[0]).len()).map(at).collect()
        };
        Ok(Self {
            ln_ext: mix(&|c| &c.ln_ext),
            ssa: mix(&|c| &c.ssa),
            asymmetry: mix(&|c| &c.asymmetry),
            ln_f11: mix(&|c| &c.ln_f11),
            ratios: mix(&|c| &c.ratios),
        })
    }

    /// Optics at a wavelength within the nodes' range.
    fn optics(&self, nodes_nm: &[f64], wavelength_nm: f64, angles: &AngleGrid) -> ParticleOptics {
        let row = INDEX_ROWS_NM.partition_point(|&w| w <= wavelength_nm);
        let first = 2 * (row.clamp(1, INDEX_ROWS_NM.len() - 1) - 1);
        let x = [0, 1, 2].map(|k| nodes_nm[first + k].ln());
        let weights = lagrange_weights(&x, wavelength_nm.ln());
        let n = angles.theta_deg().len();
        let plane = self.ln_f11.len();
        let value = |column: &[f64]| (0..3).map(|k| weights[k] * column[first + k]).sum::<f64>();
        let over_angle = |column: &[f64]| -> Vec<f64> {
            let [a, b, c] = [0, 1, 2].map(|k| &column[(first + k) * n..(first + k + 1) * n]);
            let at = |i: usize| weights[0] * a[i] + weights[1] * b[i] + weights[2] * c[i];
            (0..n).map(at).collect()
        };
        let f11: Vec<f64> = over_angle(&self.ln_f11).iter().map(|v| v.exp()).collect();
        let [mut f12, mut f33, mut f34] = [0, 1, 2]
            .map(|element| over_angle(&self.ratios[element * plane..(element + 1) * plane]));
        for i in 0..n {
            // Rounding must not let light be polarised by more than all of it.
            let squares = f12[i] * f12[i] + f33[i] * f33[i] + f34[i] * f34[i];
            let factor = f11[i] / squares.max(1.0).sqrt();
            for ratio in [&mut f12[i], &mut f33[i], &mut f34[i]] {
                *ratio *= factor;
            }
        }
        let mut matrix = ScatteringMatrix { f11, f12, f33, f34 };
        matrix.scale(1.0 / angles.sphere_integral(&matrix.f11));
        let xs_ext = value(&self.ln_ext).exp();
        ParticleOptics {
            xs_ext,
            xs_sca: xs_ext * value(&self.ssa).clamp(0.0, 1.0),
            asymmetry: value(&self.asymmetry),
            matrix,
        }
    }
}

/// Lagrange's weights of the polynomial through `x`, at a point.
fn lagrange_weights<const N: usize>(x: &[f64; N], at: f64) -> [f64; N] {
    std::array::from_fn(|i| {
        let others = (0..N).filter(|&j| j != i);
        others.map(|j| (at - x[j]) / (x[i] - x[j])).product()
    })
}

/// Optics from the shipped tables, per particle, at the angles of [`AngleGrid::default`].
///
/// `None` for particles of one's own, which have no table. `humidity_percent` \[%\] is that of the air, 0 to 99;
/// wavelengths in vacuum \[nm\], 280 to 2500.
///
/// # Errors
/// [`Error::OutOfRange`]; [`Error::Invalid`] if the embedded tables are damaged.
pub fn lookup(
    source: &ParticleSource,
    humidity_percent: f64,
    wavelength_nm: &[f64],
) -> Result<Option<Vec<ParticleOptics>>> {
    check_range("humidity", humidity_percent, "%", 0.0..=99.0)?;
    let range_nm = WavelengthGrid::MIN_NM..=WavelengthGrid::MAX_NM;
    for &nm in wavelength_nm {
        check_range("wavelength", nm, "nm", range_nm.clone())?;
    }
    let Some(particle) = source.table_name() else {
        return Ok(None);
    };
    let columns = Columns::at(source, &particle, source.humidity_percent(humidity_percent))?;
    let (nodes_nm, angles) = (wavelength_nodes_nm(), AngleGrid::default());
    let optics = |&nm: &f64| columns.optics(&nodes_nm, nm, &angles);
    Ok(Some(wavelength_nm.iter().map(optics).collect()))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn integers_survive_the_round_trip() {
        let values = [
            0,
            1,
            -1,
            63,
            -64,
            64,
            8191,
            -8192,
            i32::MAX / 2,
            i32::MIN / 2,
        ];
        let mut bytes = Vec::new();
        values.iter().for_each(|&v| push_integer(&mut bytes, v));
        assert_eq!(bytes[..4], [0, 2, 1, 126]);
        let mut bytes = bytes.into_iter();
        for v in values {
            assert_eq!(pop_integer(&mut bytes).unwrap(), v);
        }
        assert!(pop_integer(&mut bytes).is_err());
        assert!(pop_integer(&mut [0xff; 9].into_iter()).is_err());
    }

    #[test]
    fn damaged_blocks_are_errors() {
        assert!(read_block(&[1, 0], 0, 1, (1, 1)).is_err());
        assert!(read_block(&[9, 0, 0, 0, 1], 0, 1, (1, 1)).is_err());
        assert!(read_block(PHASE, 100_000, 1, (1, 1)).is_err());
        assert!(read_block(PHASE, 0, 2, (37, 463)).is_err());
    }

    #[test]
    fn nodes_are_rows_and_middles() {
        let nodes = wavelength_nodes_nm();
        assert_eq!(nodes.len(), 37);
        assert!(nodes.windows(2).all(|w| w[0] < w[1]));
        assert!(INDEX_ROWS_NM.iter().all(|w| nodes.contains(w)));
    }

    #[test]
    fn beyond_the_tables_is_refused() {
        let waso = ParticleSource::Opac("waso".into());
        assert!(lookup(&waso, 50.0, &[279.0]).is_err());
        assert!(lookup(&waso, 50.0, &[f64::NAN]).is_err());
        assert!(lookup(&waso, 99.5, &[550.0]).is_err());
        let unknown = ParticleSource::Opac("smoke".into());
        assert!(lookup(&unknown, 50.0, &[550.0]).is_err());
    }
}
