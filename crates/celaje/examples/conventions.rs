//! Draws the figures of `docs/conventions.md`: where each sensor sees north, east, south, west and the sun, and how the sky is
//! polarised.
//!
//! ```text
//! cargo run --example conventions -- docs/figures
//! ```
//!
//! Everything is placed by the sensors themselves (`direction` for sky and ground, `pixel_of` for lines and marks),
//! so the figures cannot differ from what the program does.

use std::fmt::Write as _;
use std::path::PathBuf;
use std::sync::atomic::AtomicBool;

use celaje::math::Vec3;
use celaje::medium::LayeredMedium;
use celaje::optics::Phase;
use celaje::sensor::{Directions, Fisheye, LatLong, Perspective, Sensor};
use celaje::sky::{Method, Polarised, RenderOptions, SunDisc};
use celaje::transport::Budget;
use celaje::Sky;

/// Where the sun of the figures stands: azimuth and elevation \[deg\].
const SUN: (f64, f64) = (250.0, 25.0);
/// Size of the cells in which sky and ground are painted \[pixels\].
const CELL: usize = 2;

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let folder = PathBuf::from(
        std::env::args()
            .nth(1)
            .unwrap_or_else(|| "docs/figures".to_owned()),
    );
    std::fs::create_dir_all(&folder)?;
    let figures: [(&str, Box<dyn Sensor>); 3] = [
        ("fisheye", Box::new(Fisheye::new(320, 320, 180.0)?)),
        ("latlong", Box::new(LatLong::new(480, 240)?)),
        (
            "perspective",
            Box::new(Perspective::new(420, 280, 110.0, 225.0, 15.0)?),
        ),
    ];
    for (name, sensor) in figures {
        let path = folder.join(format!("{name}.svg"));
        std::fs::write(&path, figure(name, sensor.as_ref()))?;
        println!("{}", path.display());
    }
    let path = folder.join("polarisation.svg");
    std::fs::write(&path, polarisation()?)?;
    println!("{}", path.display());
    Ok(())
}

/// A fisheye of the electric field of once-scattered light, and the basis of Stokes vectors at one point of it.
fn polarisation() -> Result<String, Box<dyn std::error::Error>> {
    let sensor = Fisheye::new(320, 320, 180.0)?;
    let mut svg = figure("polarisation", &sensor);
    svg.truncate(svg.len() - "</svg>\n".len());
    // Thin air that scatters once; the angles are those of its film.
    let mut medium = LayeredMedium::new(&[0.0, 1e4], &[500.0], 6.36e6)?;
    medium.add(&[1e-8; 2], &[0.0; 2], Phase::rayleigh(&[0.0])?)?;
    let sky = Sky::from_medium(medium, SUN.1, SUN.0, &[0.0], &[1.0], 0.0)?;
    let looks: Vec<(f64, f64)> = [8.0, 22.0, 36.0, 50.0, 64.0, 78.0]
        .into_iter()
        .flat_map(|e: f64| {
            let n = (30.0 * e.to_radians().cos()).round().max(1.0);
            (0..n as u32).map(move |k| (360.0 * f64::from(k) / n, e))
        })
        .collect();
    let (azimuth, elevation): (Vec<f64>, Vec<f64>) = looks.iter().copied().unzip();
    let options = RenderOptions {
        accuracy: celaje::transport::Accuracy::default(),
        method: Method::Path,
        budget: Budget {
            spp: 16,
            seed: 0,
            max_order: Some(1),
        },
        sun_disc: SunDisc::Off,
        altitude_m: None,
        polarised: Polarised::Stokes,
    };
    let directions = Directions::new(&azimuth, &elevation)?;
    let film = sky.render(&directions, &options, &AtomicBool::new(false), &|_, _| {})?;
    for (pixel, &(azimuth, elevation)) in looks.iter().enumerate() {
        let (theta, phi) = stokes_basis(azimuth, elevation);
        let degree = f64::from(film.degree_of_polarisation(pixel, 0).unwrap_or(0.0));
        let angle_deg = f64::from(film.angle_of_polarisation_deg(pixel, 0).unwrap_or(0.0));
        let (sin, cos) = angle_deg.to_radians().sin_cos();
        let look = Vec3::from_azimuth_elevation_deg(azimuth, elevation);
        let reach = (theta * cos + phi * sin) * (0.08 * degree);
        let bar = [-1.0, 1.0].map(|side| (look + reach * side).normalized());
        line(&mut svg, &sensor, bar.into_iter(), 2.0);
    }
    let at = (140.0, 30.0);
    let (theta, phi) = stokes_basis(at.0, at.1);
    let look = Vec3::from_azimuth_elevation_deg(at.0, at.1);
    for (label, vector) in [("θ̂", theta), ("φ̂", phi)] {
        let tip = (look + vector * 0.3).normalized();
        arrow(&mut svg, &sensor, (look, tip), label);
    }
    svg.push_str("</svg>\n");
    Ok(svg)
}

/// θ̂ and φ̂ of the light that arrives from a direction: k travels the other way.
fn stokes_basis(azimuth_deg: f64, elevation_deg: f64) -> (Vec3, Vec3) {
    let k = -Vec3::from_azimuth_elevation_deg(azimuth_deg, elevation_deg);
    let phi = Vec3::new(0.0, 0.0, 1.0).cross(k).normalized();
    (phi.cross(k), phi)
}

/// An arrow between two directions with a name at its tip.
fn arrow(svg: &mut String, sensor: &dyn Sensor, (from, to): (Vec3, Vec3), label: &str) {
    if let (Some((x0, y0)), Some((x1, y1))) = (sensor.pixel_of(from), sensor.pixel_of(to)) {
        let (dx, dy) = (x1 - x0, y1 - y0);
        let length = dx.hypot(dy);
        let (dx, dy) = (dx / length, dy / length);
        let head = [(-8.0, 4.0), (-8.0, -4.0)]
            .map(|(along, across)| (x1 + along * dx - across * dy, y1 + along * dy + across * dx));
        let _ = writeln!(
            svg,
            r##"<path stroke="#fd3" fill="#fd3" stroke-width="2.5" d="M{x0:.1} {y0:.1}L{x1:.1} {y1:.1}L{:.1} {:.1}L{:.1} {:.1}L{x1:.1} {y1:.1}"/>
<text x="{:.1}" y="{:.1}" fill="#fd3">{label}</text>"##,
            head[0].0,
            head[0].1,
            head[1].0,
            head[1].1,
            x1 + 12.0 * dx,
            y1 + 12.0 * dy + 5.0
        );
    }
}

/// One SVG: sky and ground, a net of azimuth and elevation, the four quarters and the sun.
fn figure(name: &str, sensor: &dyn Sensor) -> String {
    const MARGIN: usize = 16;
    let (width, height) = sensor.size();
    let mut svg = String::new();
    let _ = writeln!(
        svg,
        r##"<svg xmlns="http://www.w3.org/2000/svg" viewBox="-{MARGIN} -{MARGIN} {} {}" width="{}" font-family="sans-serif" font-size="15" text-anchor="middle">
<title>The {name} picture: north, east, south, west and the sun</title>
<rect x="-{MARGIN}" y="-{MARGIN}" width="100%" height="100%" fill="#fff"/>"##,
        width + 2 * MARGIN,
        height + 2 * MARGIN,
        width + 2 * MARGIN,
    );
    paint(&mut svg, sensor);
    for elevation in (-60..=60).step_by(30) {
        let curve = (0..=180)
            .map(|i| Vec3::from_azimuth_elevation_deg(2.0 * f64::from(i), f64::from(elevation)));
        let stroke = if elevation == 0 { 1.5 } else { 0.5 };
        line(&mut svg, sensor, curve, stroke);
    }
    for azimuth in (0..360).step_by(45) {
        let curve = (-44..=44)
            .map(|e| Vec3::from_azimuth_elevation_deg(f64::from(azimuth), 2.0 * f64::from(e)));
        line(&mut svg, sensor, curve, 0.5);
    }
    for (label, azimuth) in [("N", 0.0), ("E", 90.0), ("S", 180.0), ("W", 270.0)] {
        mark(&mut svg, sensor, label, (azimuth, 0.0), "#fff", 3.0);
    }
    mark(&mut svg, sensor, "zenith", (0.0, 90.0), "#fff", 3.0);
    mark(&mut svg, sensor, "sun", SUN, "#fd3", 7.0);
    svg.push_str("</svg>\n");
    svg
}

/// Fills the picture with runs of cells that look up, down, or nowhere.
fn paint(svg: &mut String, sensor: &dyn Sensor) {
    let (width, height) = sensor.size();
    let colour = |column, row| match sensor.direction(column, row, 1.0, 1.0) {
        None => "#fff",
        Some(d) if d.z >= 0.0 => "#5b86b8",
        Some(_) => "#7d6b52",
    };
    for row in (0..height).step_by(CELL) {
        let mut start = 0;
        while start < width {
            let fill = colour(start, row);
            let mut end = start + CELL;
            while end < width && colour(end, row) == fill {
                end += CELL;
            }
            let end = end.min(width);
            let _ = writeln!(
                svg,
                r#"<path fill="{fill}" d="M{start} {row}h{}v{}h-{}z"/>"#,
                end - start,
                CELL,
                end - start
            );
            start = end;
        }
    }
}

/// A curve on the sky, interrupted where it leaves the picture or jumps across its seam.
fn line(
    svg: &mut String,
    sensor: &dyn Sensor,
    curve: impl Iterator<Item = Vec3>,
    stroke_width: f64,
) {
    let seam = 0.5 * sensor.size().0 as f64;
    let mut path = String::new();
    let mut last: Option<(f64, f64)> = None;
    for direction in curve {
        let point = sensor.pixel_of(direction);
        if let Some((x, y)) = point {
            let joined = last.is_some_and(|(lx, _)| (x - lx).abs() < seam);
            let _ = write!(path, "{}{x:.1} {y:.1}", if joined { "L" } else { "M" });
        }
        last = point;
    }
    if !path.is_empty() {
        let _ = writeln!(
            svg,
            r##"<path fill="none" stroke="#fff" stroke-width="{stroke_width}" d="{path}"/>"##
        );
    }
}

/// A dot and its name, if the sensor sees it; the name is kept inside the figure.
fn mark(
    svg: &mut String,
    sensor: &dyn Sensor,
    label: &str,
    (azimuth_deg, elevation_deg): (f64, f64),
    fill: &str,
    radius: f64,
) {
    let direction = Vec3::from_azimuth_elevation_deg(azimuth_deg, elevation_deg);
    let Some((x, y)) = sensor.pixel_of(direction) else {
        return;
    };
    let (width, height) = sensor.size();
    let half_text = (6.0 * label.len() as f64).max(18.0);
    let text_x = x.clamp(half_text, width as f64 - half_text);
    let below = y + radius + 16.0;
    let text_y = if below < height as f64 {
        below
    } else {
        y - radius - 5.0
    };
    let _ = writeln!(
        svg,
        r##"<circle cx="{x:.1}" cy="{y:.1}" r="{radius}" fill="{fill}" stroke="#000"/>
<text x="{text_x:.1}" y="{text_y:.1}" fill="#fff" font-weight="bold">{label}</text>"##
    );
}
