//! Surfaces of bodies as meshes that turn under the mouse: positions in mm, colours by a length at each node, in mm.

use plotly::common::color::NamedColor;
use plotly::common::{ColorScale, ColorScalePalette, HoverInfo, Marker, Mode};
use plotly::layout::{
    AspectMode, AspectRatio, Axis, Camera, DragMode3D, Eye, LayoutScene, Projection, ProjectionType, Up,
};
use plotly::traces::mesh3d::Lighting;
use plotly::{Layout, Mesh3D, Plot, Scatter3D};

use super::plots::short;

/// Diagonal of a body in Plotly's units of length.
const FILL: f64 = 2.4;
/// Of what does not deform.
const INSTRUMENT: &str = "#b8bec4";
/// Of nodes that an instrument grips.
const POINTS: &str = "#e0202a";

/// Surfaces in one space.
#[derive(Default)]
pub struct Bodies {
    plot: Plot,
    /// Corners of the box around all of them, m.
    corners: Option<[[f64; 3]; 2]>,
}

/// Where to look from: the direction that is up, and the side that the eye is on.
#[derive(Clone, Copy)]
pub enum View {
    /// z is up, and the eye is at the front (low y), somewhat above and to the right.
    Standing,
    /// z, the long axis of a bar, goes to the right.
    Lying,
}

impl Bodies {
    /// Adds a body: positions (m), triangles, and a length at each node (m) that its colour stands for, up to `most`. Nodes inside are
    /// left out.
    pub fn add(&mut self, positions: &[[f64; 3]], triangles: &[[u32; 3]], lengths: &[f64], most: f64) {
        let (numbers, triangles) = surface(positions.len(), triangles);
        self.reach(positions, &numbers);
        let lengths: Vec<_> = numbers.iter().map(|&node| 1e3 * lengths[node]).collect();
        let words = lengths.iter().map(|length| format!("{} mm", short(*length))).collect();
        // As fine as the colours.
        let fineness = most.max(1e-6);
        let lengths = lengths.iter().map(|length| (length / fineness).round() * fineness).collect();
        let trace = Self::trace(positions, &numbers, &triangles)
            .intensity(lengths)
            .color_scale(ColorScale::Palette(ColorScalePalette::Viridis))
            .c_min(0.0)
            .c_max(1e3 * fineness)
            .show_scale(false)
            .hover_text_array(words)
            .hover_info(HoverInfo::Text);
        self.plot.add_trace(trace);
    }

    /// Adds what does not deform.
    pub fn add_rigid(&mut self, positions: &[[f64; 3]], triangles: &[[u32; 3]]) {
        let (numbers, triangles) = surface(positions.len(), triangles);
        self.reach(positions, &numbers);
        let trace =
            Self::trace(positions, &numbers, &triangles).color(INSTRUMENT).hover_info(HoverInfo::Skip);
        self.plot.add_trace(trace);
    }

    /// Adds nodes as points.
    pub fn add_points(&mut self, positions: &[[f64; 3]]) {
        let along = |axis: usize| positions.iter().map(|point| millimetres(point[axis])).collect::<Vec<_>>();
        let marker = Marker::new().size(3).color(POINTS);
        let trace = Scatter3D::new(along(0), along(1), along(2)).mode(Mode::Markers).marker(marker);
        self.plot.add_trace(trace.hover_info(HoverInfo::Skip));
    }

    fn reach(&mut self, positions: &[[f64; 3]], numbers: &[usize]) {
        let [low, high] = self.corners.get_or_insert([[f64::INFINITY; 3], [f64::NEG_INFINITY; 3]]);
        for &node in numbers {
            for axis in 0..3 {
                low[axis] = low[axis].min(positions[node][axis]);
                high[axis] = high[axis].max(positions[node][axis]);
            }
        }
    }

    fn trace(
        positions: &[[f64; 3]],
        numbers: &[usize],
        triangles: &[[usize; 3]],
    ) -> Box<Mesh3D<f64, f64, f64>> {
        let along = |axis: usize| numbers.iter().map(|&node| millimetres(positions[node][axis])).collect();
        let corner = |at: usize| Some(triangles.iter().map(|corners| corners[at]).collect());
        let lighting = Lighting::new().ambient(0.75).diffuse(0.5).specular(0.05).roughness(0.9);
        Mesh3D::new(along(0), along(1), along(2), corner(0), corner(1), corner(2))
            .flat_shading(true)
            .lighting(lighting)
    }

    /// The plot.
    pub fn plot(self, view: View) -> Plot {
        let hidden = || Axis::new().visible(false);
        let (eye, up) = match view {
            View::Standing => ([0.36, -1.0, 0.45], [0.0, 0.0, 1.0]),
            View::Lying => ([0.45, 1.0, 0.3], [1.0, 0.0, 0.0]),
        };
        let camera = Camera::new()
            .eye(Eye::from((eye[0], eye[1], eye[2])))
            .up(Up::from((up[0], up[1], up[2])))
            .projection(Projection::new().projection_type(ProjectionType::Orthographic));
        // As long as the panel is high, whichever way it is turned.
        let [low, high] = self.corners.unwrap_or_default();
        let sides = [0, 1, 2].map(|axis| high[axis] - low[axis]);
        let diagonal = sides.iter().map(|side| side * side).sum::<f64>().sqrt().max(f64::MIN_POSITIVE);
        let [x, y, z] = sides.map(|side| FILL * side / diagonal);
        let scene = LayoutScene::new()
            .aspect_mode(AspectMode::Manual)
            .aspect_ratio(AspectRatio::from((x, y, z)))
            .camera(camera)
            .drag_mode(DragMode3D::Orbit)
            .background_color(NamedColor::Transparent)
            .x_axis(hidden())
            .y_axis(hidden())
            .z_axis(hidden());
        let mut plot = self.plot;
        plot.set_layout(Layout::new().scene(scene).show_legend(false));
        plot
    }
}

/// The nodes that triangles use, and the triangles with places in these.
fn surface(nodes: usize, triangles: &[[u32; 3]]) -> (Vec<usize>, Vec<[usize; 3]>) {
    let mut places = vec![usize::MAX; nodes];
    let mut numbers = vec![];
    let mut place = |node: u32| {
        let at = &mut places[node as usize];
        if *at == usize::MAX {
            *at = numbers.len();
            numbers.push(node as usize);
        }
        *at
    };
    let triangles = triangles.iter().map(|corners| corners.map(&mut place)).collect();
    (numbers, triangles)
}

/// A length (m) in mm, to a hundredth.
fn millimetres(metres: f64) -> f64 {
    (1e5 * metres).round() / 1e2
}

/// The length of vectors.
pub fn lengths(vectors: &[[f32; 3]]) -> Vec<f64> {
    let length = |vector: &[f32; 3]| vector.iter().map(|c| f64::from(*c).powi(2)).sum::<f64>().sqrt();
    vectors.iter().map(length).collect()
}

/// The distance of each node between two shapes.
pub fn distances(a: &[[f32; 3]], b: &[[f32; 3]]) -> Vec<f64> {
    let pairs = a.iter().zip(b);
    lengths(&pairs.map(|(a, b)| [0, 1, 2].map(|axis| a[axis] - b[axis])).collect::<Vec<_>>())
}

/// The mean of lengths (m), mm.
pub fn mean_millimetres(lengths: &[f64]) -> f64 {
    1e3 * lengths.iter().sum::<f64>() / lengths.len().max(1) as f64
}

/// Points moved by displacements.
pub fn moved<T: Copy + Into<f64>>(points: &[[T; 3]], displacements: &[[f32; 3]]) -> Vec<[f64; 3]> {
    let pairs = points.iter().zip(displacements);
    pairs.map(|(point, vector)| [0, 1, 2].map(|axis| point[axis].into() + f64::from(vector[axis]))).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn nodes_inside_are_left_out() {
        let (numbers, triangles) = surface(6, &[[5, 2, 0], [2, 5, 3]]);
        assert_eq!(numbers, [5, 2, 0, 3]);
        assert_eq!(triangles, [[0, 1, 2], [1, 0, 3]]);
    }

    #[test]
    fn a_body_has_millimetres_and_one_colour_a_node() {
        let mut bodies = Bodies::default();
        let points = [[0.0; 3], [0.01, 0.0, 0.0], [0.0, 0.02, 0.0]];
        bodies.add(&points, &[[0, 1, 2]], &[0.0, 0.001, 0.002], 0.002);
        let plot: serde_json::Value = serde_json::from_str(&bodies.plot(View::Standing).to_json()).unwrap();
        let trace = &plot["data"][0];
        assert_eq!(trace["y"], serde_json::json!([0.0, 0.0, 20.0]));
        let [a, b, c] = [0, 1, 2].map(|node| trace["intensity"][node].as_f64().unwrap());
        assert!(a == 0.0 && (b - 1.0).abs() < 1e-9 && (c - 2.0).abs() < 1e-9, "{trace}");
        assert_eq!(trace["cmax"], 2.0);
        assert_eq!(plot["layout"]["scene"]["camera"]["projection"]["type"], "orthographic");
    }
}
