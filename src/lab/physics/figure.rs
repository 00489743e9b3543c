//! Which mesh, which element, which step for so many millimetres? The distance of the silicone beam's swing under
//! gravity from the recordings, mm, over the computing time of a simulated second, s, on grids: SVG with logarithmic
//! axes, a curve for each element and kind of steps, a point for each mesh.

use supple::material::Element;

use super::PhysicsRow;
use super::mesh::GRID;
use super::silicone::DISTANCE;
use super::steps::{BACKWARD_EULER, EXACT, LONG_20, LONG_100};
use super::svg::{COLOURS, line, put};

const WIDTH: f64 = 860.0;
const HEIGHT: f64 = 500.0;
const LEFT: f64 = 70.0;
const RIGHT: f64 = 590.0;
const TOP: f64 = 60.0;
const BOTTOM: f64 = 440.0;
/// Of the methods with an element, and of backward Euler.
const DASHES: [&str; 3] = ["", "8 4", "2 4"];

struct Curve {
    element: Element,
    method: &'static str,
    /// Seconds of computing, mm, tetrahedra.
    points: Vec<(f64, f64, usize)>,
}

impl Curve {
    fn is_implicit(&self) -> bool {
        BACKWARD_EULER.into_iter().any(|steps| steps.name == self.method)
    }

    fn colour(&self) -> &'static str {
        if self.is_implicit() {
            return "#777";
        }
        [COLOURS[1], COLOURS[0], COLOURS[2]][self.element.code() as usize % 3]
    }

    fn dash(&self) -> &'static str {
        let explicit = [EXACT, LONG_20, LONG_100];
        let place = [explicit, BACKWARD_EULER]
            .into_iter()
            .find_map(|methods| methods.into_iter().position(|steps| steps.name == self.method));
        DASHES[place.unwrap_or(0)]
    }

    fn stroke(&self) -> String {
        format!("{}\" stroke-width=\"2\" stroke-dasharray=\"{}", self.colour(), self.dash())
    }
}

/// A logarithmic axis between two places on the picture.
struct Axis {
    low: f64,
    high: f64,
    places: (f64, f64),
}

impl Axis {
    /// Around values, with some room at both ends.
    fn around(values: impl Iterator<Item = f64>, places: (f64, f64)) -> Self {
        let (low, high) =
            values.map(f64::log10).fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), x| (low.min(x), high.max(x)));
        Self { low: low - 0.15, high: high + 0.15, places }
    }

    fn at(&self, value: f64) -> f64 {
        let (from, to) = self.places;
        from + (value.log10() - self.low) / (self.high - self.low) * (to - from)
    }

    /// These digits of each decade.
    fn ticks(&self, digits: &[f64]) -> Vec<f64> {
        let decades = self.low.floor() as i32..=self.high.ceil() as i32;
        let ticks = decades.flat_map(|decade| digits.iter().map(move |digit| digit * 10.0_f64.powi(decade)));
        ticks.filter(|tick| (self.low..=self.high).contains(&tick.log10())).collect()
    }
}

/// The picture, if there are runs of the beam.
pub(super) fn draw(rows: &[PhysicsRow]) -> Option<String> {
    let curves = curves(rows);
    let all = || curves.iter().flat_map(|curve| &curve.points);
    all().next()?;
    let x = Axis::around(all().map(|point| point.0), (LEFT, RIGHT));
    let y = Axis::around(all().map(|point| point.1), (BOTTOM, TOP));
    let mut svg = format!(
        "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"{WIDTH}\" height=\"{HEIGHT}\" viewBox=\"0 0 {WIDTH} {HEIGHT}\" \
         font-family=\"sans-serif\" font-size=\"13\">\n<rect width=\"{WIDTH}\" height=\"{HEIGHT}\" fill=\"white\"/>\n\
         <text x=\"{LEFT}\" y=\"24\" font-size=\"16\">Silicone beam let go under its own weight: distance to the film</text>\n\
         <text x=\"{LEFT}\" y=\"44\" fill=\"#555\">a point is a mesh, with its tetrahedra; lower is nearer to nature, further left is faster</text>\n"
    );
    frame(&mut svg, &x, &y);
    for curve in &curves {
        draw_curve(&mut svg, &x, &y, curve);
    }
    legend(&mut svg, &curves);
    svg += "</svg>\n";
    Some(svg)
}

fn frame(svg: &mut String, x: &Axis, y: &Axis) {
    for tick in x.ticks(&[1.0]) {
        let at = x.at(tick);
        line(svg, (at, TOP), (at, BOTTOM), "#e4e4e4");
        let below = BOTTOM + 18.0;
        put(svg, format_args!("<text x=\"{at:.1}\" y=\"{below}\" text-anchor=\"middle\">{tick}</text>"));
    }
    for tick in y.ticks(&[1.0, 2.0, 5.0]) {
        let at = y.at(tick);
        line(svg, (LEFT, at), (RIGHT, at), "#e4e4e4");
        let (left, base) = (LEFT - 8.0, at + 4.5);
        put(svg, format_args!("<text x=\"{left}\" y=\"{base:.1}\" text-anchor=\"end\">{tick}</text>"));
    }
    let (width, height) = (RIGHT - LEFT, BOTTOM - TOP);
    put(
        svg,
        format_args!(
            "<rect x=\"{LEFT}\" y=\"{TOP}\" width=\"{width}\" height=\"{height}\" fill=\"none\" stroke=\"#333\"/>"
        ),
    );
    let (middle, below) = (0.5 * (LEFT + RIGHT), BOTTOM + 42.0);
    put(
        svg,
        format_args!(
            "<text x=\"{middle}\" y=\"{below}\" text-anchor=\"middle\">computing time of a simulated second, s (one core)</text>"
        ),
    );
    let centre = 0.5 * (TOP + BOTTOM);
    put(
        svg,
        format_args!(
            "<text transform=\"translate(18 {centre}) rotate(-90)\" text-anchor=\"middle\">rms distance over time, mm</text>"
        ),
    );
}

fn draw_curve(svg: &mut String, x: &Axis, y: &Axis, curve: &Curve) {
    let colour = curve.colour();
    for pair in curve.points.windows(2) {
        let [from, to] = [pair[0], pair[1]].map(|(time, error, _)| (x.at(time), y.at(error)));
        line(svg, from, to, &curve.stroke());
    }
    for &(time, error, tetrahedra) in &curve.points {
        let (cx, cy) = (x.at(time), y.at(error));
        let (left, top) = (cx - 4.0, cy - 4.0);
        let title = format!("<title>{tetrahedra} tetrahedra, {error:.2} mm, {time:.3} s</title>");
        if curve.is_implicit() {
            put(
                svg,
                format_args!(
                    "<rect x=\"{left:.1}\" y=\"{top:.1}\" width=\"8\" height=\"8\" fill=\"{colour}\">{title}</rect>"
                ),
            );
        } else {
            put(
                svg,
                format_args!("<circle cx=\"{cx:.1}\" cy=\"{cy:.1}\" r=\"4.5\" fill=\"{colour}\">{title}</circle>"),
            );
        }
        // Of the other curves in the same order.
        if curve.dash().is_empty() {
            let (right, above) = (cx + 6.0, cy + if curve.is_implicit() { 16.0 } else { -7.0 });
            put(
                svg,
                format_args!(
                    "<text x=\"{right:.1}\" y=\"{above:.1}\" font-size=\"11\" fill=\"{colour}\">{tetrahedra}</text>"
                ),
            );
        }
    }
}

fn legend(svg: &mut String, curves: &[Curve]) {
    for (index, curve) in curves.iter().enumerate() {
        let (left, base) = (RIGHT + 16.0, TOP + 12.0 + 22.0 * index as f64);
        line(svg, (left, base - 4.0), (left + 34.0, base - 4.0), &curve.stroke());
        let (words, text) = (format!("{}, {}", curve.element.name(), curve.method), left + 42.0);
        put(svg, format_args!("<text x=\"{text}\" y=\"{base}\">{words}</text>"));
    }
}

fn curves(rows: &[PhysicsRow]) -> Vec<Curve> {
    let mut curves: Vec<Curve> = Vec::new();
    for row in rows.iter().filter(|row| row.quantity == DISTANCE && row.mesh == GRID) {
        let (Some(error), Some(time)) = (row.value, row.us_per_simulated_second) else { continue };
        let point = (1e-6 * time, error, row.tetrahedra);
        match curves.iter_mut().find(|curve| curve.element == row.element && curve.method == row.method) {
            Some(curve) => curve.points.push(point),
            None => curves.push(Curve { element: row.element, method: row.method, points: vec![point] }),
        }
    }
    curves.sort_by_key(|curve| (curve.is_implicit(), curve.element.code()));
    curves
}
