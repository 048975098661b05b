//! Concentric shells: coefficients that depend on altitude and wavelength only, linear in altitude between nodes.

use super::{Medium, Ray, Segment, Span};
use crate::error::{check_range, Error, Result};
use crate::math::bytes::{ByteReader, ByteWriter};
use crate::math::interp::{interval, Guide};
use crate::math::{lanes, Vec3};
use crate::optics::Phase;

/// A spherical atmosphere of concentric shells.
///
/// Built from arrays: nodes in altitude, wavelengths, and for each species σ_s and σ_a on both, linear between nodes.
/// Nothing is above the last node; the first node is the ground.
#[derive(Debug, Clone)]
pub struct LayeredMedium {
    wavelength_nm: Vec<f64>,
    lanes: usize,
    altitude_m: Vec<f64>,
    radius_m: Vec<f64>,
    guide: Guide,
    /// Totals over species \[m⁻¹\], shape (node, lanes).
    sigma_t: Vec<f32>,
    sigma_s: Vec<f32>,
    species: Vec<Vec<f32>>,
    phases: Vec<Phase>,
    majorant: Majorant,
}

/// Coarse shells with one bound for all wavelengths each.
#[derive(Debug, Clone, Default)]
struct Majorant {
    /// Boundaries from the ground up \[m\], shape (k + 1,).
    radius_m: Vec<f64>,
    /// Bound in each shell \[m⁻¹\], shape (k,).
    sigma: Vec<f64>,
}

impl LayeredMedium {
    /// An empty atmosphere; fill it by [`LayeredMedium::add`].
    ///
    /// # Arguments
    /// * `altitude_m` — nodes above the sphere of `planet_radius_m`, strictly increasing, shape (z,), at least two;
    ///   the first is the ground, the last the top of the atmosphere
    /// * `wavelength_nm` — vacuum, strictly increasing, shape (w,)
    /// * `planet_radius_m` — radius of altitude 0, positive
    ///
    /// # Errors
    /// [`Error::Invalid`], [`Error::OutOfRange`].
    pub fn new(altitude_m: &[f64], wavelength_nm: &[f64], planet_radius_m: f64) -> Result<Self> {
        check_range("planet radius", planet_radius_m, "m", 1.0..=1e15)?;
        check_increasing("altitude", altitude_m, "m", 2)?;
        check_increasing("wavelength", wavelength_nm, "nm", 1)?;
        check_range("wavelength", wavelength_nm[0], "nm", 1.0..=1e9)?;
        check_range(
            "lowest altitude",
            altitude_m[0],
            "m",
            -0.5 * planet_radius_m..=1e15,
        )?;
        let lanes = lanes::padded(wavelength_nm.len());
        let rows = vec![0.0; altitude_m.len() * lanes];
        let radius_m: Vec<f64> = altitude_m.iter().map(|z| planet_radius_m + z).collect();
        Ok(Self {
            wavelength_nm: wavelength_nm.to_vec(),
            lanes,
            altitude_m: altitude_m.to_vec(),
            majorant: Majorant {
                radius_m: vec![radius_m[0], radius_m[radius_m.len() - 1]],
                sigma: vec![0.0],
            },
            guide: Guide::new(&radius_m),
            radius_m,
            sigma_t: rows.clone(),
            sigma_s: rows,
            species: Vec::new(),
            phases: Vec::new(),
        })
    }

    /// Adds a species.
    ///
    /// # Arguments
    /// * `sigma_s`, `sigma_a` — scattering and absorption coefficients \[m⁻¹\], ≥ 0, shape (z, w), linear between nodes
    /// * `phase` — its phase function at the same wavelengths
    ///
    /// # Errors
    /// [`Error::ShapeMismatch`], [`Error::OutOfRange`]; the medium is then unchanged.
    pub fn add(&mut self, sigma_s: &[f64], sigma_a: &[f64], phase: Phase) -> Result<()> {
        let (z, w) = (self.altitude_m.len(), self.wavelength_nm.len());
        for (name, values) in [("sigma_s", sigma_s), ("sigma_a", sigma_a)] {
            if values.len() != z * w {
                return Err(Error::ShapeMismatch {
                    name: name.into(),
                    got: format!("({},)", values.len()),
                    expected: format!("(altitude, wavelength) = ({z}, {w})"),
                });
            }
            for &v in values {
                check_range(name, v, "m^-1", 0.0..=1e6)?;
            }
        }
        if phase.lanes() != self.lanes {
            return Err(Error::ShapeMismatch {
                name: "phase function".into(),
                got: "another number of wavelengths".into(),
                expected: format!("{w} wavelengths, those of the medium"),
            });
        }
        let mut rows = vec![0.0; z * self.lanes];
        for node in 0..z {
            for lane in 0..w {
                let (s, a) = (sigma_s[node * w + lane], sigma_a[node * w + lane]);
                let at = node * self.lanes + lane;
                rows[at] = s as f32;
                self.sigma_s[at] += s as f32;
                self.sigma_t[at] += (s + a) as f32;
            }
        }
        self.species.push(rows);
        self.phases.push(phase);
        self.majorant = Majorant::new(&self.radius_m, &self.sigma_t, self.lanes);
        Ok(())
    }

    /// Writes everything that the medium is made of.
    pub(crate) fn encode(&self, w: &mut ByteWriter) {
        w.f64s(&self.wavelength_nm);
        w.f64s(&self.altitude_m);
        w.f64s(&self.radius_m);
        w.f32s(&self.sigma_t);
        w.f32s(&self.sigma_s);
        w.count(self.species.len());
        for (rows, phase) in self.species.iter().zip(&self.phases) {
            w.f32s(rows);
            phase.encode(w);
        }
    }

    /// The medium that [`LayeredMedium::encode`] wrote, bit for bit.
    ///
    /// # Errors
    /// [`Error::Invalid`], [`Error::OutOfRange`], [`Error::ShapeMismatch`] for values that are no medium.
    pub(crate) fn decode(r: &mut ByteReader<'_>) -> Result<Self> {
        let wavelength_nm = r.f64s()?;
        let altitude_m = r.f64s()?;
        let radius_m = r.f64s()?;
        let lowest = altitude_m.first().zip(radius_m.first());
        let planet_radius_m = lowest.map_or(f64::NAN, |(z, r)| r - z);
        let mut medium = Self::new(&altitude_m, &wavelength_nm, planet_radius_m)?;
        check_increasing("radius", &radius_m, "m", 2)?;
        let values = altitude_m.len() * medium.lanes;
        let rows = |name: &str, values_of: Vec<f32>| {
            let sound = values_of.iter().all(|v| (0.0..=1e6).contains(v));
            if values_of.len() == values && sound {
                return Ok(values_of);
            }
            Err(Error::invalid(
                format!("{name} does not fit the nodes of its medium"),
                "bake it again",
            ))
        };
        if radius_m.len() != altitude_m.len() {
            return Err(Error::ShapeMismatch {
                name: "radius".into(),
                got: format!("({},)", radius_m.len()),
                expected: format!("({},)", altitude_m.len()),
            });
        }
        medium.guide = Guide::new(&radius_m);
        medium.radius_m = radius_m;
        medium.sigma_t = rows("sigma_t", r.f32s()?)?;
        medium.sigma_s = rows("sigma_s", r.f32s()?)?;
        for _ in 0..r.count()? {
            medium.species.push(rows("a species", r.f32s()?)?);
            medium.phases.push(Phase::decode(r, medium.lanes)?);
        }
        medium.majorant = Majorant::new(&medium.radius_m, &medium.sigma_t, medium.lanes);
        Ok(medium)
    }

    /// Altitudes of the nodes \[m\], the ground first, shape (z,).
    pub fn altitude_m(&self) -> &[f64] {
        &self.altitude_m
    }

    /// Vertical optical depth from a node-independent altitude to the top, exact for coefficients linear between
    /// nodes; at one wavelength.
    pub fn vertical_optical_depth(&self, lane: usize) -> f64 {
        self.vertical_integral(&self.sigma_t, lane)
    }

    /// The share of scattering in [`LayeredMedium::vertical_optical_depth`].
    pub(crate) fn vertical_scattering_depth(&self, lane: usize) -> f64 {
        self.vertical_integral(&self.sigma_s, lane)
    }

    fn vertical_integral(&self, rows: &[f32], lane: usize) -> f64 {
        self.altitude_m
            .windows(2)
            .enumerate()
            .map(|(i, z)| {
                let sigma = |node: usize| f64::from(rows[node * self.lanes + lane]);
                0.5 * (sigma(i) + sigma(i + 1)) * (z[1] - z[0])
            })
            .sum()
    }

    /// Distances of the nodes from the planet's centre \[m\], shape (z,).
    pub(crate) fn node_radii_m(&self) -> &[f64] {
        &self.radius_m
    }

    /// One species' σ_s at a node \[m⁻¹\], one row.
    #[inline(always)]
    pub(crate) fn species_row(&self, species: usize, node: usize) -> &[f32] {
        &self.species[species][node * self.lanes..(node + 1) * self.lanes]
    }

    /// `out += factor · σ_s` of one species at a place between nodes (see [`LayeredMedium::locate_radius`]).
    #[inline(always)]
    pub(crate) fn add_scattering(
        &self,
        species: usize,
        (i, t): (usize, f32),
        factor: &[f32],
        out: &mut [f32],
    ) {
        let (below, above) = (
            self.species_row(species, i),
            self.species_row(species, i + 1),
        );
        let rows = lanes::blocks(below).zip(lanes::blocks(above));
        let rows = rows.zip(lanes::blocks(factor));
        for (out, ((a, b), &f)) in lanes::blocks_mut(out).zip(rows) {
            let (sigma, before) = (lanes::lerp_block(a, b, t), *out);
            *out = lanes::each(|i| before[i] + f[i] * sigma[i]);
        }
    }

    /// σ_t \[m⁻¹\] at a node, one row.
    #[inline(always)]
    pub(crate) fn extinction_row(&self, node: usize) -> &[f32] {
        &self.sigma_t[node * self.lanes..(node + 1) * self.lanes]
    }

    /// Node below a radius and how far it is on the way to the next, in [0, 1].
    #[inline(always)]
    pub(crate) fn locate_radius(&self, r: f64) -> (usize, f32) {
        self.locate_in_shell(self.guide.interval(r), r)
    }

    /// The same for a radius whose node below is known.
    #[inline(always)]
    pub(crate) fn locate_in_shell(&self, i: usize, r: f64) -> (usize, f32) {
        let (below, above) = (self.radius_m[i], self.radius_m[i + 1]);
        (i, ((r - below) / (above - below)).clamp(0.0, 1.0) as f32)
    }

    /// Extinction coefficient at a place found by [`LayeredMedium::locate_radius`], at one wavelength \[m⁻¹\], and its derivative by the
    /// radius \[m⁻²\].
    #[inline(always)]
    pub(crate) fn extinction_and_slope(&self, lane: usize, (i, t): (usize, f32)) -> (f64, f64) {
        let (below, above) = (
            self.extinction_row(i)[lane],
            self.extinction_row(i + 1)[lane],
        );
        let thickness_m = self.radius_m[i + 1] - self.radius_m[i];
        (
            f64::from(below + t * (above - below)),
            f64::from(above - below) / thickness_m,
        )
    }

    /// One species' σ_s at a place found by [`LayeredMedium::locate_radius`] [m⁻¹], one row.
    #[inline(always)]
    pub(crate) fn species_at(&self, species: usize, place: (usize, f32), sigma_s: &mut [f32]) {
        self.lerp_rows(&self.species[species], place, sigma_s);
    }

    /// The same air at some of its wavelengths, with a share `cut(species, i)` of each species' scattering at the i-th of
    /// them left out of the extinction. It keeps totals only: no species, no phase functions.
    pub(crate) fn truncated(&self, chosen: &[usize], cut: &dyn Fn(usize, usize) -> f64) -> Self {
        let lanes = lanes::padded(chosen.len());
        let nodes = self.radius_m.len();
        let (mut sigma_t, mut sigma_s) = (vec![0.0; nodes * lanes], vec![0.0; nodes * lanes]);
        for node in 0..nodes {
            for (j, &lane) in chosen.iter().enumerate() {
                let left_out: f64 = (0..self.species.len())
                    .map(|k| cut(k, j) * f64::from(self.species_row(k, node)[lane]))
                    .sum();
                let (from, to) = (node * self.lanes + lane, node * lanes + j);
                sigma_t[to] = (f64::from(self.sigma_t[from]) - left_out) as f32;
                sigma_s[to] = (f64::from(self.sigma_s[from]) - left_out) as f32;
            }
        }
        Self {
            wavelength_nm: chosen
                .iter()
                .map(|&lane| self.wavelength_nm[lane])
                .collect(),
            lanes,
            altitude_m: self.altitude_m.clone(),
            radius_m: self.radius_m.clone(),
            guide: self.guide.clone(),
            majorant: Majorant::new(&self.radius_m, &sigma_t, lanes),
            sigma_t,
            sigma_s,
            species: Vec::new(),
            phases: Vec::new(),
        }
    }

    /// Finds the shell of a radius.
    pub(crate) fn guide(&self) -> &Guide {
        &self.guide
    }

    /// σ_t at the nodes \[m⁻¹\], shape (z, lanes).
    pub(crate) fn extinction_rows(&self) -> &[f32] {
        &self.sigma_t
    }

    /// Node below a point and how far the point is on the way to the next, in [0, 1].
    #[inline(always)]
    fn locate(&self, at: Vec3) -> (usize, f32) {
        self.locate_radius(at.length())
    }

    #[inline(always)]
    fn lerp_rows(&self, rows: &[f32], (i, t): (usize, f32), out: &mut [f32]) {
        let n = self.lanes;
        lanes::lerp(
            &rows[i * n..(i + 1) * n],
            &rows[(i + 1) * n..(i + 2) * n],
            t,
            &mut out[..n],
        );
    }

    #[inline(always)]
    fn lerp_one(&self, rows: &[f32], lane: usize, (i, t): (usize, f32)) -> f64 {
        let (a, b) = (
            rows[i * self.lanes + lane],
            rows[(i + 1) * self.lanes + lane],
        );
        f64::from(a + t * (b - a))
    }
}

impl Medium for LayeredMedium {
    type Segments<'a> = Shells<'a>;

    fn wavelength_nm(&self) -> &[f64] {
        &self.wavelength_nm
    }

    #[inline(always)]
    fn lanes(&self) -> usize {
        self.lanes
    }

    #[inline(always)]
    fn ground_radius_m(&self) -> f64 {
        self.radius_m[0]
    }

    #[inline(always)]
    fn top_radius_m(&self) -> f64 {
        self.radius_m[self.radius_m.len() - 1]
    }

    #[inline(always)]
    fn segments(&self, ray: &Ray, span: Span) -> Shells<'_> {
        Shells::new(&self.majorant, ray, span)
    }

    #[inline(always)]
    fn extinction(&self, at: Vec3, sigma_t: &mut [f32]) {
        self.lerp_rows(&self.sigma_t, self.locate(at), sigma_t);
    }

    #[inline(always)]
    fn extinction_and_scattering(&self, at: Vec3, sigma_t: &mut [f32], sigma_s: &mut [f32]) {
        let place = self.locate(at);
        self.lerp_rows(&self.sigma_t, place, sigma_t);
        self.lerp_rows(&self.sigma_s, place, sigma_s);
    }

    #[inline(always)]
    fn phases(&self) -> &[Phase] {
        &self.phases
    }

    #[inline(always)]
    fn species_scattering(&self, species: usize, at: Vec3, sigma_s: &mut [f32]) {
        self.lerp_rows(&self.species[species], self.locate(at), sigma_s);
    }

    #[inline(always)]
    fn coefficients_at(&self, lane: usize, at: Vec3) -> (f64, f64) {
        let place = self.locate(at);
        (
            self.lerp_one(&self.sigma_t, lane, place),
            self.lerp_one(&self.sigma_s, lane, place),
        )
    }

    #[inline(always)]
    fn species_scattering_at(&self, species: usize, lane: usize, at: Vec3) -> f64 {
        self.lerp_one(&self.species[species], lane, self.locate(at))
    }

    fn global_majorant(&self, lane: usize) -> f64 {
        let highest = self
            .sigma_t
            .iter()
            .skip(lane)
            .step_by(self.lanes)
            .copied()
            .fold(0.0, f32::max);
        f64::from(highest) * Majorant::MARGIN
    }
}

impl Majorant {
    /// Bounds are raised by this factor, so that rounding never lifts a coefficient above its bound.
    const MARGIN: f64 = 1.0 + 1e-5;
    /// A shell ends where its largest bound would exceed its smallest by this factor.
    const LOOSENESS: f64 = 1.3;
    /// Air thinner than this bound is not worth a shell of its own: a grazing path of 1000 km through it has an
    /// optical depth of 0.01.
    const NEGLIGIBLE_PER_M: f64 = 1e-8;

    /// Groups nodes from the ground up into shells in which the extinction varies little.
    fn new(radius_m: &[f64], sigma_t: &[f32], lanes: usize) -> Self {
        let node_max: Vec<f64> = sigma_t
            .chunks_exact(lanes)
            .map(|row| f64::from(row.iter().copied().fold(0.0, f32::max)))
            .collect();
        let mut shells = Self {
            radius_m: vec![radius_m[0]],
            sigma: Vec::new(),
        };
        let (mut low, mut high) = (node_max[0], node_max[0]);
        for i in 1..node_max.len() {
            let new_low = low.min(node_max[i]);
            let new_high = high.max(node_max[i]);
            let too_loose =
                new_high > Self::LOOSENESS * new_low && new_high > Self::NEGLIGIBLE_PER_M;
            let started_here = shells.radius_m.last() == Some(&radius_m[i - 1]);
            if too_loose && !started_here {
                shells.sigma.push(high * Self::MARGIN);
                shells.radius_m.push(radius_m[i - 1]);
                low = node_max[i - 1].min(node_max[i]);
                high = node_max[i - 1].max(node_max[i]);
            } else {
                (low, high) = (new_low, new_high);
            }
        }
        shells.sigma.push(high * Self::MARGIN);
        shells.radius_m.push(radius_m[radius_m.len() - 1]);
        shells
    }
}

/// The shells that a ray crosses, in order.
#[derive(Debug)]
pub struct Shells<'a> {
    majorant: &'a Majorant,
    /// Where the ray is nearest the planet's centre, and how near, squared.
    tangent_m: f64,
    impact_squared: f64,
    at_m: f64,
    end_m: f64,
    shell: usize,
}

impl<'a> Shells<'a> {
    #[inline(always)]
    fn new(majorant: &'a Majorant, ray: &Ray, span: Span) -> Self {
        let radius = ray.at(span.start_m).length();
        Self {
            majorant,
            tangent_m: ray.distance_to_tangent_m(),
            impact_squared: ray.impact_parameter_squared(),
            at_m: span.start_m,
            end_m: span.end_m,
            shell: interval(&majorant.radius_m, radius),
        }
    }
}

impl Iterator for Shells<'_> {
    type Item = Segment;

    #[inline(always)]
    fn next(&mut self) -> Option<Segment> {
        if self.at_m >= self.end_m {
            return None;
        }
        let sigma_maj = self.majorant.sigma[self.shell];
        let floor = self.majorant.radius_m[self.shell];
        let below = floor * floor - self.impact_squared;
        let mut exit = f64::INFINITY;
        if self.at_m < self.tangent_m && below > 0.0 && self.shell > 0 {
            // Falling, and the shell below is reached before the turning point.
            exit = self.tangent_m - below.sqrt();
            self.shell -= 1;
        } else if self.shell + 1 < self.majorant.sigma.len() {
            let ceiling = self.majorant.radius_m[self.shell + 1];
            exit = self.tangent_m + (ceiling * ceiling - self.impact_squared).max(0.0).sqrt();
            self.shell += 1;
        }
        self.at_m = exit.min(self.end_m).max(self.at_m);
        Some(Segment {
            end_m: self.at_m,
            sigma_maj,
        })
    }
}

fn check_increasing(name: &str, values: &[f64], unit: &'static str, least: usize) -> Result<()> {
    if values.len() < least {
        return Err(Error::invalid(
            format!("{name} has {} values", values.len()),
            format!("give at least {least}"),
        ));
    }
    for &v in values {
        check_range(name, v, unit, -1e15..=1e15)?;
    }
    match values.windows(2).find(|p| p[1] <= p[0]) {
        None => Ok(()),
        Some(p) => Err(Error::invalid(
            format!(
                "{name} must increase: {} {unit} is followed by {} {unit}",
                p[0], p[1]
            ),
            "sort the values and drop repeated ones",
        )),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn exponential(scale_height_m: f64) -> LayeredMedium {
        let altitude_m: Vec<f64> = (0..=400).map(|i| 250.0 * f64::from(i)).collect();
        let sigma: Vec<f64> = altitude_m
            .iter()
            .flat_map(|z| [2e-5, 1e-5].map(|s| s * (-z / scale_height_m).exp()))
            .collect();
        let mut m = LayeredMedium::new(&altitude_m, &[450.0, 650.0], 6_360_000.0).unwrap();
        m.add(
            &sigma,
            &vec![0.0; sigma.len()],
            Phase::rayleigh(&[0.03, 0.03]).unwrap(),
        )
        .unwrap();
        m
    }

    /// Rationale: tracking is unbiased only under a bound. Expected: at every point of many rays, rising, falling and
    /// grazing, the shell's majorant is at least the extinction, and the shells join without gaps.
    #[test]
    fn majorants_bound_the_extinction_along_rays() {
        let m = exponential(8000.0);
        assert!(m.majorant.sigma.len() > 10);
        let mut row = vec![0.0; m.lanes()];
        for altitude in [0.0, 10.0, 5_000.0, 99_000.0, 400_000.0] {
            for elevation in [
                90.0, 30.0, 1.0, 0.0, -0.05, -1.5, -4.0, -10.0, -19.0, -20.0, -90.0,
            ] {
                let ray = Ray {
                    origin: Vec3::new(0.0, 0.0, 6_360_000.0 + altitude),
                    direction: Vec3::from_azimuth_elevation_deg(70.0, elevation),
                };
                let Some((span, _)) = ray.through_air(m.ground_radius_m(), m.top_radius_m()) else {
                    continue;
                };
                let mut at = span.start_m;
                for segment in m.segments(&ray, span) {
                    for k in 0..20 {
                        let s = at + (segment.end_m - at) * (f64::from(k) + 0.5) / 20.0;
                        m.extinction(ray.at(s), &mut row);
                        assert!(
                            f64::from(row[0]) <= segment.sigma_maj,
                            "{altitude} m, {elevation} deg, s = {s}"
                        );
                    }
                    at = segment.end_m;
                }
                assert_eq!(at, span.end_m, "{altitude} m, {elevation} deg");
            }
        }
    }

    #[test]
    fn vertical_optical_depth_of_an_exponential() {
        let m = exponential(8000.0);
        let exact = 2e-5 * 8000.0 * (1.0 - (-100.0f64 / 8.0).exp());
        assert!((m.vertical_optical_depth(0) / exact - 1.0).abs() < 1e-4);
    }

    #[test]
    fn bad_arrays_are_refused_and_change_nothing() {
        assert!(LayeredMedium::new(&[0.0], &[550.0], 6.36e6).is_err());
        assert!(LayeredMedium::new(&[0.0, 0.0], &[550.0], 6.36e6).is_err());
        assert!(LayeredMedium::new(&[0.0, f64::NAN], &[550.0], 6.36e6).is_err());
        assert!(LayeredMedium::new(&[0.0, 1.0], &[], 6.36e6).is_err());
        assert!(LayeredMedium::new(&[0.0, 1.0], &[550.0], -1.0).is_err());
        let mut m = exponential(8000.0);
        let before = m.sigma_t.clone();
        let phase = || Phase::rayleigh(&[0.03, 0.03]).unwrap();
        assert!(m.add(&[0.0; 4], &[0.0; 4], phase()).is_err());
        let mut sigma = vec![0.0; 802];
        sigma[7] = -1e-9;
        assert!(m.add(&sigma, &vec![0.0; 802], phase()).is_err());
        sigma[7] = f64::NAN;
        assert!(m.add(&vec![0.0; 802], &sigma, phase()).is_err());
        assert_eq!(m.sigma_t, before);
    }
}
