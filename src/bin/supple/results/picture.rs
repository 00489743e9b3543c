//! A picture of a body at rest and deformed, as SVG: boundary triangles in parallel projection, far ones
//! first, lit from the upper left, coloured by displacement in millimetres.

use std::fmt::Write as _;

/// Panel width and height, pixels; margin around bodies.
const PANEL: (f64, f64) = (520.0, 400.0);
const MARGIN: f64 = 30.0;
/// Dark blue to yellow through teal (five points of viridis), sRGB.
const COLOURS: [[f64; 3]; 5] =
    [[68.0, 1.0, 84.0], [59.0, 82.0, 139.0], [33.0, 145.0, 140.0], [94.0, 201.0, 98.0], [253.0, 231.0, 37.0]];

/// One panel: positions (m) and displacement (m) of each node.
pub(crate) struct Panel<'a> {
    pub(crate) title: &'a str,
    pub(crate) positions: &'a [[f64; 3]],
    pub(crate) displacements: &'a [f64],
}

type Point = [f64; 3];

fn sub(a: Point, b: Point) -> Point {
    [a[0] - b[0], a[1] - b[1], a[2] - b[2]]
}

fn dot(a: Point, b: Point) -> f64 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

fn cross(a: Point, b: Point) -> Point {
    [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
}

fn unit(a: Point) -> Point {
    let length = dot(a, a).sqrt().max(f64::MIN_POSITIVE);
    a.map(|component| component / length)
}

fn colour(share: f64, light: f64) -> String {
    let at = share.clamp(0.0, 1.0) * (COLOURS.len() - 1) as f64;
    let low = (at as usize).min(COLOURS.len() - 2);
    let mix = |channel: usize| {
        let (a, b) = (COLOURS[low][channel], COLOURS[low + 1][channel]);
        ((a + (b - a) * (at - low as f64)) * light).clamp(0.0, 255.0) as u8
    };
    format!("#{:02x}{:02x}{:02x}", mix(0), mix(1), mix(2))
}

/// Draws the panels in a row at one scale, seen from the front (low y), somewhat from above and the
/// right.
pub(crate) fn draw(panels: &[Panel<'_>], triangles: &[[u32; 3]], largest: f64) -> String {
    let toward_eye = unit([0.35, -1.0, 0.45]);
    let right = unit(cross([0.0, 0.0, 1.0], toward_eye));
    let up = cross(toward_eye, right);
    let light = unit([-0.4, -0.7, 0.9]);
    let flat = |point: Point| [dot(point, right), -dot(point, up)];

    // One window for all panels.
    let mut window = [f64::INFINITY, f64::INFINITY, f64::NEG_INFINITY, f64::NEG_INFINITY];
    for point in panels.iter().flat_map(|panel| panel.positions) {
        let [x, y] = flat(*point);
        window = [window[0].min(x), window[1].min(y), window[2].max(x), window[3].max(y)];
    }
    let scale = ((PANEL.0 - 2.0 * MARGIN) / (window[2] - window[0]))
        .min((PANEL.1 - 2.0 * MARGIN - 40.0) / (window[3] - window[1]));
    let (width, height) = (PANEL.0 * panels.len() as f64, PANEL.1 + 70.0);
    let mut svg = format!(
        "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"{width}\" height=\"{height}\" \
         viewBox=\"0 0 {width} {height}\" font-family=\"sans-serif\" font-size=\"15\">\n\
         <rect width=\"100%\" height=\"100%\" fill=\"white\"/>\n"
    );
    for (index, panel) in panels.iter().enumerate() {
        let left = PANEL.0 * index as f64;
        let place = |node: u32| {
            let [x, y] = flat(panel.positions[node as usize]);
            (left + MARGIN + (x - window[0]) * scale, MARGIN + 40.0 + (y - window[1]) * scale)
        };
        let mut visible: Vec<_> = triangles
            .iter()
            .filter_map(|triangle| {
                let [a, b, c] = triangle.map(|node| panel.positions[node as usize]);
                let normal = unit(cross(sub(b, a), sub(c, a)));
                let depth = dot(a, toward_eye) + dot(b, toward_eye) + dot(c, toward_eye);
                (dot(normal, toward_eye) > 0.0).then_some((depth, triangle, normal))
            })
            .collect();
        visible.sort_by(|a, b| a.0.total_cmp(&b.0));
        // Writing to a string does not fail.
        let _ = writeln!(svg, "<text x=\"{}\" y=\"32\">{}</text>", left + MARGIN, panel.title);
        for (_, triangle, normal) in visible {
            let mean = triangle.iter().map(|&node| panel.displacements[node as usize]).sum::<f64>() / 3.0;
            let fill =
                colour(mean / largest.max(f64::MIN_POSITIVE), 0.55 + 0.5 * dot(normal, light).max(0.0));
            let [a, b, c] = triangle.map(place);
            let _ = writeln!(
                svg,
                "<path d=\"M{:.1} {:.1}L{:.1} {:.1}L{:.1} {:.1}Z\" fill=\"{fill}\" stroke=\"{fill}\" stroke-width=\"0.6\"/>",
                a.0, a.1, b.0, b.1, c.0, c.1
            );
        }
    }
    legend(&mut svg, largest, scale, width, height);
    svg.push_str("</svg>\n");
    svg
}

/// A colour bar in millimetres and a bar of 50 mm for lengths.
fn legend(svg: &mut String, largest: f64, scale: f64, width: f64, height: f64) {
    let (left, top, length, steps) = (MARGIN, height - 48.0, 260.0, 52);
    for step in 0..steps {
        let share = f64::from(step) / f64::from(steps - 1);
        let _ = writeln!(
            svg,
            "<rect x=\"{:.1}\" y=\"{top:.1}\" width=\"{:.1}\" height=\"14\" fill=\"{}\"/>",
            left + length * f64::from(step) / f64::from(steps),
            length / f64::from(steps) + 0.5,
            colour(share, 1.0)
        );
    }
    let text = top + 32.0;
    let _ = writeln!(svg, "<text x=\"{left}\" y=\"{text:.1}\">0</text>");
    let _ = writeln!(
        svg,
        "<text x=\"{:.1}\" y=\"{text:.1}\" text-anchor=\"end\">{:.1} mm displacement</text>",
        left + length,
        1e3 * largest
    );
    let (from, to) = (width - MARGIN - 0.05 * scale, width - MARGIN);
    let _ = writeln!(
        svg,
        "<path d=\"M{from:.1} {0:.1}v-8v4H{to:.1}v-4v8\" fill=\"none\" stroke=\"black\"/>\n\
         <text x=\"{1:.1}\" y=\"{text:.1}\" text-anchor=\"middle\">50 mm</text>",
        top + 10.0,
        0.5 * (from + to)
    );
}
