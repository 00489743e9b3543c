//! Which mesh, which element, which step for so many millimetres? The silicone beam's mean distance to the recordings, mm, over the
//! computing time of a simulated second, s: SVG with logarithmic axes, a curve for each element and method, a point for each mesh.

use std::format;
use std::string::String;
use std::vec::Vec;

use super::Row;
use super::silicone::DISTANCE;
use crate::lab::plot::{COLOURS, line, put};
use crate::material::Element;

const WIDTH: f64 = 820.0;
const HEIGHT: f64 = 460.0;
const LEFT: f64 = 76.0;
const RIGHT: f64 = 560.0;
const TOP: f64 = 44.0;
const BOTTOM: f64 = 400.0;

struct Curve {
    element: Element,
    method: &'static str,
    /// Seconds of computing, mm, tetrahedra.
    points: Vec<(f64, f64, usize)>,
}

/// The picture, if there are runs of the beam.
pub(super) fn draw(rows: &[Row]) -> Option<String> {
    let curves = curves(rows);
    let all = || curves.iter().flat_map(|curve| &curve.points);
    let decades = |of: fn(&(f64, f64, usize)) -> f64| {
        let (low, high) = all()
            .map(of)
            .map(f64::log10)
            .fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), x| (low.min(x), high.max(x)));
        (low.floor(), high.ceil())
    };
    all().next()?;
    let (across, up) = (decades(|point| point.0), decades(|point| point.1));
    let x = |time: f64| LEFT + (time.log10() - across.0) / (across.1 - across.0).max(1.0) * (RIGHT - LEFT);
    let y = |error: f64| BOTTOM - (error.log10() - up.0) / (up.1 - up.0).max(1.0) * (BOTTOM - TOP);
    let mut svg = format!(
        "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"{WIDTH}\" height=\"{HEIGHT}\" viewBox=\"0 0 {WIDTH} {HEIGHT}\" \
         font-family=\"sans-serif\" font-size=\"13\">\n<rect width=\"{WIDTH}\" height=\"{HEIGHT}\" fill=\"white\"/>\n\
         <text x=\"{LEFT}\" y=\"26\" font-size=\"16\">Silicone beam under gravity: distance to nature</text>\n"
    );
    for decade in across.0 as i32..=across.1 as i32 {
        let time = 10.0_f64.powi(decade);
        line(&mut svg, (x(time), TOP), (x(time), BOTTOM), "#ddd");
        put(
            &mut svg,
            format_args!(
                "<text x=\"{:.1}\" y=\"{}\" text-anchor=\"middle\">{time}</text>",
                x(time),
                BOTTOM + 20.0
            ),
        );
    }
    for decade in up.0 as i32..=up.1 as i32 {
        let error = 10.0_f64.powi(decade);
        line(&mut svg, (LEFT, y(error)), (RIGHT, y(error)), "#ddd");
        put(
            &mut svg,
            format_args!(
                "<text x=\"{}\" y=\"{:.1}\" text-anchor=\"end\">{error}</text>",
                LEFT - 8.0,
                y(error) + 4.5
            ),
        );
    }
    for (index, curve) in curves.iter().enumerate() {
        let stroke = format!("{}\" stroke-width=\"2", COLOURS[index % COLOURS.len()]);
        for pair in curve.points.windows(2) {
            line(&mut svg, (x(pair[0].0), y(pair[0].1)), (x(pair[1].0), y(pair[1].1)), &stroke);
        }
        for &(time, error, tetrahedra) in &curve.points {
            let colour = COLOURS[index % COLOURS.len()];
            put(
                &mut svg,
                format_args!(
                    "<circle cx=\"{:.1}\" cy=\"{:.1}\" r=\"4\" fill=\"{colour}\"><title>{tetrahedra} tetrahedra</title></circle>",
                    x(time),
                    y(error)
                ),
            );
        }
        let (left, top) = (RIGHT + 16.0, TOP + 12.0 + 22.0 * index as f64);
        line(&mut svg, (left, top - 4.0), (left + 18.0, top - 4.0), &stroke);
        let words = format!("{}, {}", curve.element.name(), curve.method);
        put(&mut svg, format_args!("<text x=\"{}\" y=\"{top}\">{words}</text>", left + 24.0));
    }
    let (middle, below) = (0.5 * (LEFT + RIGHT), BOTTOM + 44.0);
    put(
        &mut svg,
        format_args!(
            "<text x=\"{middle}\" y=\"{below}\" text-anchor=\"middle\">computing time of a simulated second, s</text>"
        ),
    );
    let centre = 0.5 * (TOP + BOTTOM);
    put(
        &mut svg,
        format_args!(
            "<text transform=\"translate(18 {centre}) rotate(-90)\" text-anchor=\"middle\">mean distance at rest and lowest, mm</text>"
        ),
    );
    svg += "</svg>\n";
    Some(svg)
}

fn curves(rows: &[Row]) -> Vec<Curve> {
    let mut curves: Vec<Curve> = Vec::new();
    for row in rows.iter().filter(|row| row.quantity == DISTANCE) {
        let (Some(error), Some(time)) = (row.value, row.us_per_simulated_second) else { continue };
        let point = (1e-6 * time, error, row.tetrahedra);
        match curves.iter_mut().find(|curve| curve.element == row.element && curve.method == row.method) {
            Some(curve) => curve.points.push(point),
            None => curves.push(Curve { element: row.element, method: row.method, points: std::vec![point] }),
        }
    }
    curves
}
