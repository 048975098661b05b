//! Writes the table of aerosol types of the manual: `cargo run --release -p celaje --example aerosol_table > docs/aerosols.md`.

use celaje::composition::aerosol::{aerosol_names, AerosolType};
use celaje::composition::upper::{Mesosphere, Stratosphere};
use celaje::optics::{aerosol_optics, AerosolOptics, LayerOptics};
use celaje::{Result, WavelengthGrid};

/// OPAC's published values at 550 nm and 80 % humidity: column optical depth, and of the mixing layer single-scattering
/// albedo, asymmetry, Ångström exponents from 350 to 500 nm and 500 to 800 nm (Hess, Koepke & Schult 1998, Tables 4 and 5, quoted from
/// memory).
pub const OPAC_PUBLISHED: [(&str, [f64; 5]); 10] = [
    ("opac:continental-clean", [0.064, 0.972, 0.709, 1.10, 1.42]),
    (
        "opac:continental-average",
        [0.151, 0.925, 0.703, 1.11, 1.42],
    ),
    (
        "opac:continental-polluted",
        [0.327, 0.892, 0.698, 1.13, 1.45],
    ),
    ("opac:urban", [0.643, 0.817, 0.689, 1.14, 1.43]),
    ("opac:desert", [0.286, 0.888, 0.729, 0.20, 0.17]),
    ("opac:maritime-clean", [0.096, 0.997, 0.772, 0.12, 0.08]),
    ("opac:maritime-polluted", [0.117, 0.975, 0.756, 0.41, 0.35]),
    ("opac:maritime-tropical", [0.056, 0.998, 0.774, 0.07, 0.04]),
    ("opac:arctic", [0.063, 0.887, 0.721, 0.85, 0.89]),
    ("opac:antarctic", [0.072, 1.000, 0.784, 0.34, 0.73]),
];

const HEAD: &str = "\
# Aerosol types in numbers

Made by `cargo run --release -p celaje --example aerosol_table > docs/aerosols.md`; a test keeps it up to date.

At 550 nm and 80 % relative humidity, at 45° N: optical depth of the whole column as the type defines it (AIAA: scaled to
0.12 in the troposphere), and of the lowest layer single-scattering albedo ω, asymmetry g, Ångström exponents α from 350
to 500 nm and from 500 to 800 nm, and the phase function's ratio of backward to sideward light p(180°)/p(90°). Below, in
italics, what Hess, Koepke & Schult 1998 (Bull. Amer. Met. Soc. 79, 831–844, Tables 4 and 5) publish for OPAC's types. The paper
was not at hand: its figures are quoted from memory, except for continental polluted, whose optical depth, ω and g an output
of OPAC 3.1 gives as 0.327, 0.8925 and 0.6977. No such values are published for the AIAA types with Jaenicke's distributions.

| type | optical depth | ω | g | α 350–500 | α 500–800 | p(180°)/p(90°) |
|---|---|---|---|---|---|---|
";

/// Optics at 350, 500, 550 and 800 nm.
pub fn optics(aerosol: &AerosolType) -> Result<AerosolOptics> {
    let grid = WavelengthGrid::new(vec![350.0, 500.0, 550.0, 800.0])?;
    aerosol_optics(aerosol, 80.0, &grid)
}

/// ω, g, α 350–500, α 500–800 and p(180°)/p(90°) of a layer.
pub fn values(layer: &LayerOptics) -> [f64; 5] {
    let alpha = |a: usize, b: usize, nm: [f64; 2]| {
        -(layer.xs_ext[a] / layer.xs_ext[b]).ln() / (nm[0] / nm[1]).ln()
    };
    let p = &layer.matrix[2].f11;
    [
        layer.xs_sca[2] / layer.xs_ext[2],
        layer.asymmetry[2],
        alpha(0, 1, [350.0, 500.0]),
        alpha(1, 3, [500.0, 800.0]),
        p[p.len() - 1] / p[p.len() / 2],
    ]
}

fn line(name: &str, depth: f64, layer: &LayerOptics) -> String {
    let [ssa, g, a1, a2, back] = values(layer);
    // So that no "-0.00" is printed.
    let [a1, a2] = [a1, a2].map(|a| if a.abs() < 0.005 { 0.0 } else { a });
    format!("| {name} | {depth:.3} | {ssa:.3} | {g:.3} | {a1:.2} | {a2:.2} | {back:.2} |\n")
}

/// The whole page.
pub fn page() -> Result<String> {
    let mut text = HEAD.to_owned();
    for name in aerosol_names() {
        let optics = optics(&AerosolType::named(&name, 45.0)?)?;
        let depth: f64 = optics.layers.iter().map(|l| l.aod_550_above(0.0)).sum();
        text += &line(&name, depth, &optics.layers[0]);
        if let Some((_, [tau, ssa, g, a1, a2])) = OPAC_PUBLISHED.iter().find(|(n, _)| *n == name) {
            text +=
                &format!("| | *{tau:.3}* | *{ssa:.3}* | *{g:.3}* | *{a1:.2}* | *{a2:.2}* | |\n");
        }
    }
    text += "\nAbove the tropopause (optical depth of the layer; Henyey–Greenstein phase functions where LOWTRAN gives no particles):\n\n\
             | layer | optical depth | ω | g | α 350–500 | α 500–800 | p(180°)/p(90°) |\n|---|---|---|---|---|---|---|\n";
    let base = AerosolType::named("opac:continental-average", 45.0)?;
    for (stratosphere, name, _) in Stratosphere::ALL {
        let upper = stratosphere.layers(base.upper_layers())?;
        for layer in optics(&base.clone().with_upper_layers(upper))?.layers {
            if !layer.scales_with_aod {
                let name = format!("{}, {name}", layer.name);
                text += &line(&name, layer.aod_550_above(0.0), &layer);
            }
        }
    }
    let upper = Mesosphere::DustAndIce.layers()?;
    for layer in optics(&base.with_upper_layers(upper))?.layers {
        if !layer.scales_with_aod {
            let (depth, row) = (layer.aod_550_above(0.0), line(&layer.name, 0.0, &layer));
            text += &row.replacen("0.000", &format!("{depth:.1e}"), 1);
        }
    }
    Ok(text)
}

fn main() -> Result<()> {
    print!("{}", page()?);
    Ok(())
}
