//! A sweep as a picture: SVG with logarithmic axes, error in mm over multiples of the scene's step.

use core::fmt::Write;
use std::format;
use std::string::String;
use std::vec::Vec;

use super::sweep::{Curve, MULTIPLES};

const WIDTH: f64 = 760.0;
const HEIGHT: f64 = 460.0;
const LEFT: f64 = 76.0;
const RIGHT: f64 = 530.0;
const TOP: f64 = 44.0;
const BOTTOM: f64 = 400.0;
/// Marks of divergence stand in lines of their own above the largest error, one a curve, so far apart.
const MARKS: f64 = 16.0;
/// Okabe and Ito's palette, which colour-blind people tell apart.
pub(super) const COLOURS: [&str; 7] =
    ["#0072b2", "#d55e00", "#009e73", "#cc79a7", "#e69f00", "#56b4e9", "#000000"];

/// Draws the curves of `scene`; `hold` (mm) is the error of a body that never moves.
#[must_use]
pub fn draw(scene: &str, step: f32, curves: &[Curve], hold: f64) -> String {
    let frame = Frame::around(curves, hold);
    let mut svg = format!(
        "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"{WIDTH}\" height=\"{HEIGHT}\" \
         viewBox=\"0 0 {WIDTH} {HEIGHT}\" font-family=\"sans-serif\" font-size=\"13\">\n\
         <rect width=\"{WIDTH}\" height=\"{HEIGHT}\" fill=\"white\"/>\n\
         <text x=\"{LEFT}\" y=\"26\" font-size=\"16\">Error over step: {scene}</text>\n"
    );
    axes(&mut svg, &frame, step);
    let y = frame.y(hold);
    line(&mut svg, (LEFT, y), (RIGHT, y), "#777\" stroke-dasharray=\"6 4");
    key(&mut svg, 0, "#777", "standing still");
    for (index, curve) in curves.iter().enumerate() {
        let colour = COLOURS[index % COLOURS.len()];
        let places: Vec<_> = curve.points.iter().map(|(x, y)| (frame.x(*x), frame.y(*y))).collect();
        for pair in places.windows(2) {
            line(&mut svg, pair[0], pair[1], &format!("{colour}\" stroke-width=\"2"));
        }
        for (x, y) in places {
            put(&mut svg, format_args!("<circle cx=\"{x:.1}\" cy=\"{y:.1}\" r=\"4\" fill=\"{colour}\"/>"));
        }
        let y = TOP + MARKS * (index + 1) as f64;
        for multiple in &curve.diverged {
            let x = frame.x(*multiple);
            line(&mut svg, (x - 4.0, y - 4.0), (x + 4.0, y + 4.0), &format!("{colour}\" stroke-width=\"2"));
            line(&mut svg, (x - 4.0, y + 4.0), (x + 4.0, y - 4.0), &format!("{colour}\" stroke-width=\"2"));
        }
        let slope = curve.slope().map_or_else(|| "no slope".into(), |slope| format!("slope {slope:.2}"));
        key(&mut svg, index + 1, colour, &format!("{}, {slope}", curve.name));
    }
    if curves.iter().any(|curve| !curve.diverged.is_empty()) {
        let y = TOP + 12.0 + 22.0 * (curves.len() + 1) as f64;
        let x = RIGHT + 16.0;
        put(
            &mut svg,
            format_args!("<text x=\"{x}\" y=\"{y}\" fill=\"#555\">\u{d7}  diverged at this step</text>"),
        );
    }
    svg += "</svg>\n";
    svg
}

/// Decades of error and where they end.
struct Frame {
    low: f64,
    high: f64,
    top: f64,
}

impl Frame {
    /// Whole decades around all errors, and above them the marks.
    fn around(curves: &[Curve], hold: f64) -> Self {
        let errors = curves.iter().flat_map(|curve| &curve.points).map(|(_, error)| *error);
        let (low, high) = errors
            .chain([hold])
            .map(f64::log10)
            .fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), error| (low.min(error), high.max(error)));
        let marks = MARKS * (curves.len() + 1) as f64;
        Self { low: low.floor(), high: high.floor() + 1.0, top: TOP + marks }
    }

    fn x(&self, multiple: f64) -> f64 {
        // From 0.8 to 250, so that no mark lies on the frame.
        let share = (multiple / 0.8).log10() / (250.0_f64 / 0.8).log10();
        LEFT + share * (RIGHT - LEFT)
    }

    fn y(&self, error: f64) -> f64 {
        BOTTOM - (error.log10() - self.low) / (self.high - self.low) * (BOTTOM - self.top)
    }
}

fn axes(svg: &mut String, frame: &Frame, step: f32) {
    for decade in frame.low as i32..=frame.high as i32 {
        let error = 10.0_f64.powi(decade);
        let y = frame.y(error);
        line(svg, (LEFT, y), (RIGHT, y), "#ddd");
        let (x, y) = (LEFT - 8.0, y + 4.5);
        put(svg, format_args!("<text x=\"{x}\" y=\"{y:.1}\" text-anchor=\"end\">{error}</text>"));
    }
    for multiple in MULTIPLES {
        let x = frame.x(f64::from(multiple));
        line(svg, (x, TOP), (x, BOTTOM), "#eee");
        let y = BOTTOM + 20.0;
        put(svg, format_args!("<text x=\"{x:.1}\" y=\"{y}\" text-anchor=\"middle\">{multiple}</text>"));
    }
    let (width, height) = (RIGHT - LEFT, BOTTOM - TOP);
    put(
        svg,
        format_args!(
            "<rect x=\"{LEFT}\" y=\"{TOP}\" width=\"{width}\" height=\"{height}\" fill=\"none\" stroke=\"#333\"/>"
        ),
    );
    let (x, y) = (0.5 * (LEFT + RIGHT), BOTTOM + 44.0);
    let step = f64::from(step * 1e6).round();
    put(
        svg,
        format_args!(
            "<text x=\"{x}\" y=\"{y}\" text-anchor=\"middle\">step, multiples of {step} \u{b5}s</text>"
        ),
    );
    let y = 0.5 * (TOP + BOTTOM);
    put(
        svg,
        format_args!(
            "<text transform=\"translate(18 {y}) rotate(-90)\" text-anchor=\"middle\">mean error over time, mm</text>"
        ),
    );
}

/// A line of the legend.
fn key(svg: &mut String, index: usize, colour: &str, words: &str) {
    let (x, y) = (RIGHT + 16.0, TOP + 12.0 + 22.0 * index as f64);
    line(svg, (x, y - 4.0), (x + 18.0, y - 4.0), &format!("{colour}\" stroke-width=\"2"));
    put(svg, format_args!("<text x=\"{}\" y=\"{y}\">{words}</text>", x + 24.0));
}

pub(super) fn line(svg: &mut String, (x1, y1): (f64, f64), (x2, y2): (f64, f64), stroke: &str) {
    put(
        svg,
        format_args!(
            "<line x1=\"{x1:.1}\" y1=\"{y1:.1}\" x2=\"{x2:.1}\" y2=\"{y2:.1}\" stroke=\"{stroke}\"/>"
        ),
    );
}

pub(super) fn put(svg: &mut String, element: core::fmt::Arguments<'_>) {
    // A string takes whatever is written to it.
    let _ = writeln!(svg, "{element}");
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::vec;

    #[test]
    fn a_picture_is_xml_with_all_points_inside_its_frame() {
        let points = vec![(2.0, 1e-4), (10.0, 3e-3), (50.0, 0.8)];
        let curves = [
            Curve { name: "bold", points, diverged: vec![100.0, 200.0] },
            Curve { name: "gone", points: vec![], diverged: vec![2.0] },
        ];
        let svg = draw("reversed", 3e-5, &curves, 12.5);
        let tree = roxmltree::Document::parse(&svg).unwrap();
        let attribute =
            |node: roxmltree::Node<'_, '_>, name| node.attribute(name).unwrap().parse::<f64>().unwrap();
        let circles: Vec<_> = tree.descendants().filter(|node| node.has_tag_name("circle")).collect();
        assert_eq!(circles.len(), 3);
        for circle in circles {
            assert!((LEFT..RIGHT).contains(&attribute(circle, "cx")));
            // Below the marks of divergence.
            assert!((TOP + 2.0 * MARKS..=BOTTOM).contains(&attribute(circle, "cy")));
        }
        for words in ["bold, slope 2.79", "gone, no slope", "standing still", "mean error over time, mm"] {
            assert!(svg.contains(words), "{words}");
        }
    }
}
