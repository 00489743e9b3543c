//! How an element locks, as a picture: the silicone beam at rest with 52 g hung from its end, from the side, with each
//! element and with the markers as they were filmed. SVG, true to scale; colours say how far a place has sunk.

use supple::material::Element;

use super::LabError;
use super::mesh::same;
use super::recordings::MARKERS;
use super::silicone::{self, LOADS, SIZE};
use super::steps::EXACT;
use super::svg::put;

/// Cells of the coarser and of the finer picture.
const CELLS: [[u32; 3]; 2] = [[6, 2, 2], [13, 4, 4]];
/// How far along the beam the markers have moved at rest, mm: mean of the two recordings.
const FILMED_ALONG: [f64; 3] = [3.6, 0.9, -3.7];
/// Pixels for a millimetre.
const SCALE: f64 = 5.0;
const LEFT: f64 = 40.0;
const PANEL: f64 = 320.0;
const WIDTH: f64 = 720.0;
/// Drop of the last colour, mm.
const MOST: f64 = 20.0;
/// From no drop to the most: of viridis.
const COLOURS: [[f64; 3]; 5] =
    [[68.0, 1.0, 84.0], [59.0, 82.0, 139.0], [33.0, 145.0, 140.0], [94.0, 201.0, 98.0], [253.0, 231.0, 37.0]];

/// A panel for each element.
pub(super) fn draw(meshes: usize) -> Result<String, LabError> {
    let [_, load] = LOADS;
    let height = PANEL * Element::ALL.len() as f64 + 90.0;
    let mut svg = format!(
        "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"{WIDTH}\" height=\"{height}\" viewBox=\"0 0 {WIDTH} {height}\" \
         font-family=\"sans-serif\" font-size=\"14\">\n<rect width=\"{WIDTH}\" height=\"{height}\" fill=\"white\"/>\n\
         <text x=\"{LEFT}\" y=\"24\" font-size=\"17\">Silicone beam with 52 g hung from its end, at rest, true to scale</text>\n"
    );
    let filmed = load.recordings.map(|recording| recording.markers.map(|marker| marker.rest));
    let filmed: [f64; 3] = core::array::from_fn(|marker| 0.5 * (filmed[0][marker] + filmed[1][marker]));
    for (panel, element) in Element::ALL.into_iter().enumerate() {
        let body = silicone::body(silicone::grid(CELLS[usize::from(meshes > 1)]), load);
        let (state, row) = body.measure(silicone::NAME, element, EXACT, |setup| silicone::hung(setup, &body));
        let Some(state) = state else { continue };
        let markers = silicone::markers(&body.mesh);
        let (drops, along) = (markers.drops(&state), markers.moved(&state, 0));
        let top = PANEL * panel as f64 + 240.0;
        let place = |x: f64, z: f64| (LEFT + SCALE * x, top - SCALE * z);
        put(
            &mut svg,
            format_args!(
                "<text x=\"{LEFT}\" y=\"{:.1}\" font-size=\"16\">{} ({} tetrahedra): the left marker sinks {:.1} mm, filmed {:.1} mm</text>",
                top - 190.0,
                element.name(),
                row.tetrahedra,
                drops[1],
                filmed[1]
            ),
        );
        for triangle in body.mesh.triangles(&body.mesh.nodes(|[_, y, _]| same(y, 0.0))) {
            let corners = triangle.map(|node| {
                let [x, _, z] = body.mesh.point(node);
                let [u, _, w] = state.displacements()[node as usize].to_array().map(f64::from);
                let (x, y) = place(1e3 * (x + u), 1e3 * (z + w));
                (format!("{x:.1},{y:.1}"), -1e3 * w)
            });
            let drop = corners.iter().map(|corner| corner.1).sum::<f64>() / 3.0;
            let (corners, colour) = (corners.map(|corner| corner.0).join(" "), colour(drop / MOST));
            put(
                &mut svg,
                format_args!("<polygon points=\"{corners}\" fill=\"{colour}\" stroke=\"white\" stroke-width=\"0.6\"/>"),
            );
        }
        let ((x, y), width, height) = (place(0.0, 30.0), 1e3 * SCALE * SIZE[0], 1e3 * SCALE * SIZE[2]);
        put(
            &mut svg,
            format_args!(
                "<rect x=\"{x}\" y=\"{y}\" width=\"{width}\" height=\"{height}\" fill=\"none\" stroke=\"#777\" stroke-dasharray=\"5 4\"/>\n\
                 <line x1=\"{x}\" y1=\"{}\" x2=\"{x}\" y2=\"{}\" stroke=\"black\" stroke-width=\"5\"/>",
                y - 8.0,
                y + height + 8.0
            ),
        );
        for (marker, (_, [_, z])) in MARKERS.into_iter().enumerate() {
            let at = |along: f64, drop: f64| place(1e3 * SIZE[0] + along, z - drop);
            circle(&mut svg, at(along[marker], drops[marker]), "black", "none");
            circle(&mut svg, at(FILMED_ALONG[marker], filmed[marker]), "none", "#d55e00");
        }
    }
    legend(&mut svg, height - 40.0);
    svg += "</svg>\n";
    Ok(svg)
}

fn legend(svg: &mut String, y: f64) {
    let steps: Vec<f64> = (0..40).map(|step| f64::from(step) / 40.0).collect();
    for share in &steps {
        let (x, colour) = (LEFT + 200.0 * share, colour(*share));
        put(svg, format_args!("<rect x=\"{x:.1}\" y=\"{y:.1}\" width=\"5.2\" height=\"12\" fill=\"{colour}\"/>"));
    }
    let base = y + 28.0;
    for (x, words) in [(LEFT, "0"), (LEFT + 90.0, "10"), (LEFT + 180.0, "20 mm down")] {
        put(svg, format_args!("<text x=\"{x}\" y=\"{base:.1}\">{words}</text>"));
    }
    circle(svg, (LEFT + 320.0, y + 6.0), "black", "none");
    circle(svg, (LEFT + 500.0, y + 6.0), "none", "#d55e00");
    for (x, words) in [(332.0, "markers, simulated"), (514.0, "markers, filmed")] {
        let (x, base) = (LEFT + x, y + 11.0);
        put(svg, format_args!("<text x=\"{x}\" y=\"{base:.1}\">{words}</text>"));
    }
}

fn circle(svg: &mut String, (x, y): (f64, f64), fill: &str, stroke: &str) {
    let radius = if fill == "none" { 7 } else { 4 };
    put(
        svg,
        format_args!(
            "<circle cx=\"{x:.1}\" cy=\"{y:.1}\" r=\"{radius}\" fill=\"{fill}\" stroke=\"{stroke}\" stroke-width=\"2.5\"/>"
        ),
    );
}

fn colour(share: f64) -> String {
    let at = share.clamp(0.0, 1.0) * (COLOURS.len() - 1) as f64;
    let low = (at as usize).min(COLOURS.len() - 2);
    let mix = |channel: usize| {
        let (a, b) = (COLOURS[low][channel], COLOURS[low + 1][channel]);
        (a + (at - low as f64) * (b - a)).round()
    };
    format!("rgb({},{},{})", mix(0), mix(1), mix(2))
}
