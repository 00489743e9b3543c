//! Surfaces of bodies as meshes that turn under the mouse: positions in mm, colours by a length at each node, in mm.

use base64::Engine as _;
use base64::engine::general_purpose::STANDARD;
use serde_json::{Value, json};

use super::plots::{Motion, Plot, short};

/// Diagonal of a body in Plotly's units of length.
const FILL: f64 = 2.4;
/// Of what does not deform.
pub(super) const INSTRUMENT: &str = "#b8bec4";
/// Of nodes that an instrument grips.
const POINTS: &str = "#e0202a";

const AXES: [&str; 3] = ["x", "y", "z"];

/// Surfaces in one space.
#[derive(Default)]
pub struct Bodies {
    traces: Vec<Value>,
    /// Corners of the box around all of them, m.
    corners: Option<[[f64; 3]; 2]>,
    motion: Option<Motion>,
}

/// How a body in motion looks.
#[derive(Clone, Copy)]
pub enum Colour<'a> {
    /// By how far it has moved from the mean of its nodes, up to so many m.
    Moved { most: f64 },
    /// The same everywhere.
    Plain(&'a str),
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
    /// Adds a body: positions (m), triangles, and a length at each node (m) that its colour stands for, up to `most`.
    /// Nodes inside are left out.
    pub fn add(&mut self, positions: &[[f64; 3]], triangles: &[[u32; 3]], lengths: &[f64], most: f64) {
        let surface = surface(positions.len(), triangles);
        let lengths = surface.0.iter().map(|&node| 1e3 * lengths[node]);
        let words: Value = lengths.clone().map(|length| format!("{} mm", short(length))).collect();
        // As fine as the colours.
        let fineness = most.max(1e-6);
        let lengths: Value = lengths.map(|length| (length / fineness).round() * fineness).collect();
        let looks = json!({
            "intensity": lengths,
            "colorscale": "Viridis",
            "cmin": 0.0,
            "cmax": 1e3 * fineness,
            "showscale": false,
            "hovertext": words,
            "hoverinfo": "text",
        });
        self.add_surface(positions, &surface, looks);
    }

    /// Adds what does not deform.
    pub fn add_rigid(&mut self, positions: &[[f64; 3]], triangles: &[[u32; 3]]) {
        let looks = json!({ "color": INSTRUMENT, "hoverinfo": "skip" });
        self.add_surface(positions, &surface(positions.len(), triangles), looks);
    }

    /// Adds nodes as points.
    pub fn add_points(&mut self, positions: &[[f64; 3]]) {
        let mut trace = json!({
            "type": "scatter3d",
            "mode": "markers",
            "marker": { "size": 3, "color": POINTS },
            "hoverinfo": "skip",
        });
        for (axis, name) in AXES.into_iter().enumerate() {
            trace[name] = positions.iter().map(|point| millimetres(point[axis])).collect();
        }
        self.traces.push(trace);
    }

    /// Adds a body in motion: its positions (m) at some times (s), coloured by how far its nodes have moved since the first
    /// more or less than their mean, up to `most` (m), or as it is told. What is around others is seen through.
    pub fn add_moving(&mut self, times: &[f64], positions: &[Vec<[f64; 3]>], triangles: &[[u32; 3]], colour: Colour) {
        let (Some(first), Some(last)) = (positions.first(), positions.last()) else { return };
        let surface = surface(last.len(), triangles);
        let looks = match colour {
            Colour::Moved { most } => {
                let moved = distances_from_mean(first, last);
                let moved = surface.0.iter().map(|&node| 1e3 * moved[node]);
                json!({
                    "intensity": moved.collect::<Vec<_>>(),
                    "colorscale": "Viridis",
                    "cmin": 0.0,
                    "cmax": 1e3 * most,
                    "showscale": false,
                    "opacity": 0.6,
                    "hoverinfo": "skip",
                })
            }
            Colour::Plain(colour) => json!({ "color": colour, "hoverinfo": "skip" }),
        };
        let motion = self.motion.get_or_insert_with(|| Motion { times: times.to_vec(), points: vec![] });
        let at = |positions: &Vec<[f64; 3]>| {
            let numbers = surface.0.iter().flat_map(|&node| positions[node]);
            let bytes = numbers.flat_map(|metres| ((1e5 * metres).round() as i16).to_le_bytes());
            STANDARD.encode(bytes.collect::<Vec<_>>())
        };
        motion.points.push((self.traces.len(), positions.iter().map(at).collect()));
        self.add_surface(last, &surface, looks);
        if let Some(trace) = self.traces.last_mut() {
            trace["flatshading"] = false.into();
            trace["lighting"] = json!({ "ambient": 0.5, "diffuse": 0.8, "specular": 0.15, "roughness": 0.6 });
        }
    }

    /// Adds the places of a surface to a trace that says already what it looks like.
    fn add_surface(&mut self, positions: &[[f64; 3]], (numbers, triangles): &Surface, mut trace: Value) {
        trace["type"] = "mesh3d".into();
        trace["flatshading"] = true.into();
        trace["lighting"] = json!({ "ambient": 0.75, "diffuse": 0.5, "specular": 0.05, "roughness": 0.9 });
        let [low, high] = self.corners.get_or_insert([[f64::INFINITY; 3], [f64::NEG_INFINITY; 3]]);
        for (axis, name) in AXES.into_iter().enumerate() {
            let along = numbers.iter().map(|&node| positions[node][axis]);
            low[axis] = along.clone().fold(low[axis], f64::min);
            high[axis] = along.clone().fold(high[axis], f64::max);
            trace[name] = along.map(millimetres).collect();
        }
        for (at, name) in ["i", "j", "k"].into_iter().enumerate() {
            trace[name] = triangles.iter().map(|corners| corners[at]).collect();
        }
        self.traces.push(trace);
    }

    /// The plot.
    pub fn plot(self, view: View) -> Plot {
        let (eye, up) = match view {
            View::Standing => ([0.36, -1.0, 0.45], [0.0, 0.0, 1.0]),
            View::Lying => ([0.45, 1.0, 0.3], [1.0, 0.0, 0.0]),
        };
        // As long as the panel is high, whichever way it is turned.
        let [low, high] = self.corners.unwrap_or_default();
        let sides = [0, 1, 2].map(|axis| high[axis] - low[axis]);
        let diagonal = sides.iter().map(|side| side * side).sum::<f64>().sqrt().max(f64::MIN_POSITIVE);
        let xyz = |[x, y, z]: [f64; 3]| json!({ "x": x, "y": y, "z": z });
        let hidden = json!({ "visible": false });
        let scene = json!({
            "aspectmode": "manual",
            "aspectratio": xyz(sides.map(|side| FILL * side / diagonal)),
            "camera": { "eye": xyz(eye), "up": xyz(up), "projection": { "type": "orthographic" } },
            "dragmode": "orbit",
            "bgcolor": "transparent",
            "xaxis": hidden,
            "yaxis": hidden,
            "zaxis": hidden,
        });
        Plot { data: self.traces, layout: json!({ "scene": scene, "showlegend": false }), motion: self.motion }
    }
}

/// The nodes that triangles use, and the triangles with places in these.
type Surface = (Vec<usize>, Vec<[usize; 3]>);

fn surface(nodes: usize, triangles: &[[u32; 3]]) -> Surface {
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

/// How far each point has moved from the first to the last place, less what all have in the mean.
pub fn distances_from_mean(first: &[[f64; 3]], last: &[[f64; 3]]) -> Vec<f64> {
    let moved = || first.iter().zip(last).map(|(first, last)| [0, 1, 2].map(|axis| last[axis] - first[axis]));
    let mean = [0, 1, 2].map(|axis| moved().map(|moved| moved[axis]).sum::<f64>() / first.len().max(1) as f64);
    moved().map(|moved| (0..3).map(|axis| (moved[axis] - mean[axis]).powi(2)).sum::<f64>().sqrt()).collect()
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
        let plot = bodies.plot(View::Standing);
        let trace = &plot.data[0];
        assert_eq!(trace["y"], json!([0.0, 0.0, 20.0]));
        let [a, b, c] = [0, 1, 2].map(|node| trace["intensity"][node].as_f64().unwrap());
        assert!(a == 0.0 && (b - 1.0).abs() < 1e-9 && (c - 2.0).abs() < 1e-9, "{trace}");
        assert_eq!(trace["cmax"], 2.0);
        assert_eq!(plot.layout["scene"]["camera"]["projection"]["type"], "orthographic");
    }
}
