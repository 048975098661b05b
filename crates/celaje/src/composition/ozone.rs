//! The shape of the ozone layer.

use super::air::LogLinear;
use crate::error::Result;
use crate::math::Table;

/// Ozone of the U.S. Standard Atmosphere 1976 \[m⁻³\]: mid-latitude annual mean, maximum at 22 km.
///
/// # Source
/// Krueger & Minzner 1976, doi:10.1029/JC081i024p04477, to 74 km; AFGL 1986 above.
pub(super) fn krueger_minzner() -> Result<LogLinear> {
    let table = Table::parse(
        "ozone_profile_us76",
        include_str!("../../../../data/ozone_profile_us76/krueger_minzner.csv"),
    )?;
    Ok(LogLinear::new(
        table.numbers("altitude_m")?,
        &table.numbers("ozone_m3")?,
    ))
}

#[cfg(test)]
mod tests {
    use super::super::air::DOBSON_UNIT_M2;
    use super::super::grid::{column, VerticalGrid};
    use super::*;

    /// The column stated beside the published table is 349.8 DU; log-linear pieces between its nodes, 2 km apart,
    /// hold a little less than its trapezia (349.2 DU).
    #[test]
    fn column_and_maximum_are_the_published_ones() {
        let layer = krueger_minzner().unwrap();
        let grid = VerticalGrid::standard(0.0).unwrap();
        let z = grid.altitude_m();
        let ozone: Vec<f64> = z.iter().map(|&z| layer.at(z)).collect();
        let du = column(z, &ozone) / DOBSON_UNIT_M2;
        assert!((du / 349.8 - 1.0).abs() < 0.015, "{du}");
        let highest = (0..z.len()).max_by(|&a, &b| ozone[a].total_cmp(&ozone[b]));
        assert_eq!(highest.map(|i| z[i]), Some(22_000.0));
    }
}
