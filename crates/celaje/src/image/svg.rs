//! Line charts as SVG: enough for a figure of the air, with nothing to install.

use std::fmt::Write as _;
use std::ops::Range;

/// Colours of lines that people with any colour vision can tell apart (Okabe & Ito 2008, <https://jfly.uni-koeln.de/color>),
/// then an ochre and greys.
pub const COLOURS: [&str; 9] = [
    "#0072b2", "#e69f00", "#009e73", "#cc79a7", "#56b4e9", "#d55e00", "#785e28", "#6e6e6e",
    "#b0b0b0",
];

/// Colours of axes, words and grid.
const INK: &str = "#26262b";
const FAINT: &str = "#e3e3e6";
/// Room around the plotting area of a chart \[px\]: left, right, top, bottom.
const MARGIN: [f64; 4] = [64.0, 14.0, 34.0, 46.0];
/// Height of a line of the legend \[px\].
const LEGEND_PX: f64 = 15.0;

/// How values are spread along an axis.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Scale {
    /// Evenly.
    Linear,
    /// By their logarithm; the range is positive.
    Log,
    /// By their square root: small ones have more room, and 0 has its place.
    Root,
}

/// An axis.
#[derive(Debug, Clone, PartialEq)]
pub struct Axis {
    /// What it shows, with its unit.
    pub label: String,
    /// From its lower to its upper end.
    pub range: Range<f64>,
    /// How values are spread along it.
    pub scale: Scale,
}

impl Axis {
    /// A linear axis.
    pub fn linear(label: &str, range: Range<f64>) -> Self {
        Self {
            label: label.to_owned(),
            range,
            scale: Scale::Linear,
        }
    }

    /// An axis by square roots, from 0.
    pub fn root(label: &str, to: f64) -> Self {
        Self {
            label: label.to_owned(),
            range: 0.0..to,
            scale: Scale::Root,
        }
    }

    /// A logarithmic axis between whole powers of ten that hold the largest of some values and what is above `share` of it.
    pub fn log(label: &str, values: impl Iterator<Item = f64>, share: f64) -> Self {
        let largest = values.filter(|v| v.is_finite()).fold(0.0, f64::max);
        let largest = if largest > 0.0 { largest } else { 1.0 };
        let top = largest.log10().ceil();
        Self {
            label: label.to_owned(),
            range: 10f64.powf(top + share.log10().round())..10f64.powf(top),
            scale: Scale::Log,
        }
    }

    /// Where a value lies, 0 at the lower end and 1 at the upper; none for what a logarithm cannot show.
    fn place(&self, value: f64) -> Option<f64> {
        let to = |v: f64| match self.scale {
            Scale::Linear => v,
            Scale::Log => v.log10(),
            Scale::Root => v.sqrt(),
        };
        let at = (to(value) - to(self.range.start)) / (to(self.range.end) - to(self.range.start));
        at.is_finite().then_some(at)
    }

    /// Values and words of the ticks.
    fn ticks(&self) -> Vec<(f64, String)> {
        if self.scale == Scale::Root {
            let power = 10f64.powf(self.range.end.log10().floor() - 2.0);
            let parts = [0.0, 1.0, 2.0, 5.0, 10.0, 20.0, 50.0, 100.0, 200.0, 500.0].iter();
            let values = parts.map(|p| p * power);
            let shown =
                values.filter(|v| *v == 0.0 || (0.01..=1.0).contains(&(v / self.range.end)));
            return shown.map(|v| (v, v.to_string())).collect();
        }
        if self.scale == Scale::Log {
            let (low, high) = (self.range.start.log10(), self.range.end.log10());
            let step = ((high - low) / 6.0).ceil().max(1.0) as i32;
            let powers = (low.ceil() as i32..=high.floor() as i32).filter(|p| p % step == 0);
            let tick = |p: i32| {
                let words = format!(
                    "10<tspan dy=\"-5\" font-size=\"9\">{}</tspan>",
                    p.to_string().replace('-', "−")
                );
                (10f64.powi(p), words)
            };
            return powers.map(tick).collect();
        }
        // Steps of 1, 2 or 5 times a power of ten, at most six of them.
        let rough = (self.range.end - self.range.start) / 6.0;
        let power = 10f64.powf(rough.log10().floor());
        let step = [1.0, 2.0, 5.0, 10.0]
            .map(|s| s * power)
            .into_iter()
            .find(|s| *s >= rough)
            .unwrap_or(rough);
        let decimals = (-step.log10().floor()).max(0.0) as usize;
        let first = (self.range.start / step - 1e-9).ceil() as i64;
        let last = (self.range.end / step + 1e-9).floor() as i64;
        let tick = |k: i64| {
            let value = k as f64 * step;
            (value, format!("{value:.decimals$}").replace('-', "−"))
        };
        (first..=last).map(tick).collect()
    }
}

/// A named line through points.
#[derive(Debug, Clone, PartialEq)]
pub struct Line {
    /// What the legend calls it; nothing to leave it out there.
    pub name: String,
    /// An SVG colour.
    pub colour: String,
    /// Whether it is broken into dashes.
    pub dashed: bool,
    /// x and y; a point that cannot be shown breaks the line.
    pub points: Vec<(f64, f64)>,
}

/// One set of axes with its lines.
#[derive(Debug, Clone, PartialEq)]
pub struct Chart {
    /// Words above it.
    pub title: String,
    /// The horizontal axis.
    pub x: Axis,
    /// The vertical axis.
    pub y: Axis,
    /// In the order of the legend.
    pub lines: Vec<Line>,
    /// Where the legend stands: 0 is the left or upper end of the chart, 1 the right or lower.
    pub legend: (f64, f64),
}

/// Charts side by side in rows of `columns`, each of a size \[px\], under a title.
pub fn page(title: &str, charts: &[Chart], columns: usize, (width, height): (f64, f64)) -> String {
    let rows = charts.len().div_ceil(columns.max(1));
    let (w, h) = (width * columns as f64, height * rows as f64 + 40.0);
    let mut text = format!(
        "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"{w}\" height=\"{h}\" viewBox=\"0 0 {w} {h}\" \
         font-family=\"Helvetica, Arial, sans-serif\" font-size=\"12\" fill=\"{INK}\">\n\
         <rect width=\"{w}\" height=\"{h}\" fill=\"white\"/>\n\
         <text x=\"20\" y=\"28\" font-size=\"17\">{}</text>\n",
        escaped(title)
    );
    for (i, chart) in charts.iter().enumerate() {
        let (column, row) = (i % columns, i / columns);
        let (x, y) = (width * column as f64, 40.0 + height * row as f64);
        // Writing to a string cannot fail.
        let _ = writeln!(text, "<g transform=\"translate({x} {y})\">");
        chart.draw(&mut text, i, width, height);
        text.push_str("</g>\n");
    }
    text.push_str("</svg>\n");
    text
}

impl Chart {
    fn draw(&self, out: &mut String, number: usize, width: f64, height: f64) {
        let [left, right, top, bottom] = MARGIN;
        let (w, h) = (width - left - right, height - top - bottom);
        let x = |v: f64| self.x.place(v).map(|t| left + w * t);
        let y = |v: f64| self.y.place(v).map(|t| top + h * (1.0 - t));
        let _ = writeln!(
            out,
            "<text x=\"{left}\" y=\"{}\" font-size=\"14\">{}</text>\n\
             <clipPath id=\"c{number}\"><rect x=\"{left}\" y=\"{top}\" width=\"{w}\" height=\"{h}\"/></clipPath>",
            top - 10.0,
            escaped(&self.title)
        );
        for (value, words) in self.x.ticks() {
            if let Some(at) = x(value) {
                let (low, below) = (top + h, top + h + 17.0);
                let _ = writeln!(
                    out,
                    "<path d=\"M{at:.1} {top}V{low}\" stroke=\"{FAINT}\"/>\
                     <text x=\"{at:.1}\" y=\"{below}\" text-anchor=\"middle\">{words}</text>"
                );
            }
        }
        for (value, words) in self.y.ticks() {
            if let Some(at) = y(value) {
                let (end, beside) = (left + w, left - 7.0);
                let _ = writeln!(
                    out,
                    "<path d=\"M{left} {at:.1}H{end}\" stroke=\"{FAINT}\"/>\
                     <text x=\"{beside}\" y=\"{:.1}\" text-anchor=\"end\">{words}</text>",
                    at + 4.0
                );
            }
        }
        let (middle_x, middle_y) = (left + 0.5 * w, top + 0.5 * h);
        let _ = writeln!(
            out,
            "<rect x=\"{left}\" y=\"{top}\" width=\"{w}\" height=\"{h}\" fill=\"none\" stroke=\"{INK}\"/>\n\
             <text x=\"{middle_x}\" y=\"{}\" text-anchor=\"middle\">{}</text>\n\
             <text transform=\"translate(15 {middle_y}) rotate(-90)\" text-anchor=\"middle\">{}</text>",
            height - 10.0,
            escaped(&self.x.label),
            escaped(&self.y.label)
        );
        for line in &self.lines {
            let path = path(line.points.iter().map(|&(a, b)| x(a).zip(y(b))));
            let _ = writeln!(
                out,
                "<path d=\"{path}\" clip-path=\"url(#c{number})\" fill=\"none\" stroke=\"{}\" stroke-width=\"1.8\"{}/>",
                line.colour,
                line.dashes()
            );
        }
        self.draw_legend(out, (left, top), (w, h));
    }

    fn draw_legend(&self, out: &mut String, (left, top): (f64, f64), (w, h): (f64, f64)) {
        let named: Vec<&Line> = self.lines.iter().filter(|l| !l.name.is_empty()).collect();
        let longest = named.iter().map(|l| l.name.chars().count()).max();
        let Some(longest) = longest else { return };
        // About 6.2 px per letter, a sample of the line and some air.
        let box_w = 40.0 + 6.2 * longest as f64;
        let box_h = LEGEND_PX * named.len() as f64 + 8.0;
        let x = left + 6.0 + (w - box_w - 12.0).max(0.0) * self.legend.0;
        let y = top + 6.0 + (h - box_h - 12.0).max(0.0) * self.legend.1;
        let _ = writeln!(
            out,
            "<rect x=\"{x:.1}\" y=\"{y:.1}\" width=\"{box_w:.1}\" height=\"{box_h:.1}\" fill=\"white\" fill-opacity=\"0.8\"/>"
        );
        for (i, line) in named.iter().enumerate() {
            let middle = y + 4.0 + LEGEND_PX * (i as f64 + 0.5);
            let _ = writeln!(
                out,
                "<path d=\"M{:.1} {middle:.1}h20\" stroke=\"{}\" stroke-width=\"2.2\"{}/>\
                 <text x=\"{:.1}\" y=\"{:.1}\" font-size=\"11.5\">{}</text>",
                x + 5.0,
                line.colour,
                line.dashes(),
                x + 31.0,
                middle + 4.0,
                escaped(&line.name)
            );
        }
    }
}

impl Line {
    fn dashes(&self) -> &'static str {
        if self.dashed {
            " stroke-dasharray=\"6 4\""
        } else {
            ""
        }
    }
}

/// The commands of a path through points, begun anew after each that cannot be shown.
fn path(points: impl Iterator<Item = Option<(f64, f64)>>) -> String {
    let mut text = String::new();
    let mut pen_down = false;
    for point in points {
        if let Some((x, y)) = point {
            // Far outside the chart numbers need not be exact, only finite and short.
            let (x, y) = (x.clamp(-1e4, 1e4), y.clamp(-1e4, 1e4));
            let _ = write!(text, "{}{x:.1} {y:.1}", if pen_down { 'L' } else { 'M' });
        }
        pen_down = point.is_some();
    }
    text
}

fn escaped(text: &str) -> String {
    text.replace('&', "&amp;")
        .replace('<', "&lt;")
        .replace('>', "&gt;")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ticks_are_round_and_inside() {
        let words =
            |axis: &Axis| -> Vec<String> { axis.ticks().into_iter().map(|t| t.1).collect() };
        let linear = Axis::linear("", 380.0..780.0);
        assert_eq!(words(&linear), ["400", "500", "600", "700"]);
        assert_eq!(
            words(&Axis::linear("", -0.1..0.3)),
            ["−0.1", "0.0", "0.1", "0.2", "0.3"]
        );
        let log = Axis::log("", [3.0, 250.0, f64::NAN].into_iter(), 1e-4);
        assert_eq!((log.range.start.round(), log.range.end), (0.0, 1000.0));
        let values: Vec<f64> = log
            .ticks()
            .into_iter()
            .map(|t| t.0.log10().round())
            .collect();
        assert_eq!(values, [-1.0, 0.0, 1.0, 2.0, 3.0]);
        assert!((log.place(10.0).unwrap() - 0.5).abs() < 1e-12);
        assert_eq!(log.place(0.0), None);
        let root = Axis::root("", 100.0);
        assert_eq!(words(&root), ["0", "1", "2", "5", "10", "20", "50", "100"]);
        assert_eq!(root.place(25.0), Some(0.5));
        // Nothing to show is no reason to fail.
        assert_eq!(Axis::log("", std::iter::empty(), 1e-2).range.end, 1.0);
    }

    #[test]
    fn a_line_is_broken_where_it_cannot_be_shown() {
        let points = [Some((1.0, 2.0)), None, Some((3.0, 4.0)), Some((5.0, 1e9))];
        assert_eq!(path(points.into_iter()), "M1.0 2.0M3.0 4.0L5.0 10000.0");
    }

    #[test]
    fn words_cannot_break_the_page() {
        let chart = Chart {
            title: "a < b & c".into(),
            x: Axis::linear("x", 0.0..1.0),
            y: Axis::linear("y", 0.0..1.0),
            lines: vec![Line {
                name: "<script>".into(),
                colour: COLOURS[0].into(),
                dashed: true,
                points: vec![(0.0, 0.0), (1.0, 1.0)],
            }],
            legend: (1.0, 0.0),
        };
        let text = page("t", &[chart], 1, (300.0, 200.0));
        assert!(text.contains("a &lt; b &amp; c") && text.contains("&lt;script&gt;"));
        assert!(!text.contains("<script>") && text.ends_with("</svg>\n"));
        assert_eq!(text.matches("<g ").count(), text.matches("</g>").count());
    }
}
