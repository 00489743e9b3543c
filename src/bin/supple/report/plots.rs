//! Plots of curves and points over two axes, linear or logarithmic, as plotly.js reads them. Numbers have five digits:
//! what an eye can see, in a quarter of the bytes.

use serde::{Deserialize, Serialize};
use serde_json::{Value, json};

/// What plotly.js draws: its traces, and a layout, to which `page.js` adds colours and margins.
#[derive(Deserialize, Serialize)]
pub struct Plot {
    pub data: Vec<Value>,
    pub layout: Value,
    /// Bodies in motion.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub motion: Option<Motion>,
}

/// Where the points of some traces are at each time.
#[derive(Deserialize, Serialize)]
pub struct Motion {
    /// s.
    pub times: Vec<f64>,
    /// The trace, and for each time its points: x, y, z in hundredths of a millimetre, as whole numbers of 16 bits in base64.
    pub points: Vec<(usize, Vec<String>)>,
}

/// plotly.js's names of lines.
#[derive(Clone, Copy, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum DashType {
    Solid,
    Dash,
    Dot,
}

/// plotly.js's names of marks.
#[derive(Clone, Copy, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum MarkerSymbol {
    Circle,
    CircleOpen,
    Square,
    SquareOpen,
    Diamond,
    DiamondOpen,
    X,
}

/// Okabe and Ito's palette, which colour-blind people tell apart, with brown in place of black.
pub const COLOURS: [&str; 7] = ["#0072b2", "#d55e00", "#009e73", "#cc79a7", "#e69f00", "#56b4e9", "#a0522d"];
/// Of what is not a method: standing still, real time.
pub const GREY: &str = "#8a8f94";

/// Points of one kind, or a curve through them.
#[derive(Clone)]
pub struct Curve {
    name: String,
    x: Vec<f64>,
    y: Vec<f64>,
    words: Vec<String>,
    colour: String,
    dash: DashType,
    symbol: Option<MarkerSymbol>,
    is_line: bool,
    is_stairs: bool,
}

impl Curve {
    /// A line through points, in blue.
    pub fn new(name: impl Into<String>, x: Vec<f64>, y: Vec<f64>) -> Self {
        Self {
            name: name.into(),
            x,
            y,
            words: vec![],
            colour: COLOURS[0].into(),
            dash: DashType::Solid,
            symbol: None,
            is_line: true,
            is_stairs: false,
        }
    }

    pub fn coloured(self, colour: &str) -> Self {
        Self { colour: colour.into(), ..self }
    }

    pub fn dashed(self, dash: DashType) -> Self {
        Self { dash, ..self }
    }

    /// With a mark at each point.
    pub fn marked(self, symbol: MarkerSymbol) -> Self {
        Self { symbol: Some(symbol), ..self }
    }

    /// Without the line.
    pub fn points(self) -> Self {
        Self { is_line: false, ..self }
    }

    /// Each value holds to the next.
    pub fn stairs(self) -> Self {
        Self { is_stairs: true, ..self }
    }

    /// With words at each point, under the mouse.
    pub fn saying(self, words: Vec<String>) -> Self {
        Self { words, ..self }
    }

    fn without_zeros(mut self) -> Self {
        let pairs = self.x.iter().copied().zip(self.y.iter().copied());
        (self.x, self.y) = pairs.filter(|(_, y)| *y > 0.0).unzip();
        self
    }

    fn trace(self) -> Value {
        let rounded = |values: Vec<f64>| values.into_iter().map(rounded).collect::<Value>();
        let mode = match (self.is_line, self.symbol.is_some()) {
            (true, true) => "lines+markers",
            (false, _) => "markers",
            (true, false) => "lines",
        };
        let shape = if self.is_stairs { "hv" } else { "linear" };
        let symbol = self.symbol.unwrap_or(MarkerSymbol::Circle);
        let mut trace = json!({
            "type": "scatter",
            "name": self.name,
            "mode": mode,
            "x": rounded(self.x),
            "y": rounded(self.y),
            "line": { "color": self.colour, "dash": self.dash, "width": 1.8, "shape": shape },
            "marker": { "color": self.colour, "size": 8, "symbol": symbol },
        });
        if !self.words.is_empty() {
            trace["hovertext"] = self.words.into();
            trace["hoverinfo"] = "text".into();
        }
        trace
    }
}

/// Five digits.
fn rounded(value: f64) -> f64 {
    if !value.is_finite() { value } else { format!("{value:.4e}").parse().unwrap_or(value) }
}

/// A length or a time for people, three digits.
pub fn short(value: f64) -> String {
    let digits = if value == 0.0 { 0.0 } else { value.abs().log10().floor() };
    format!("{value:.*}", (2.0 - digits).clamp(0.0, 6.0) as usize)
}

fn plot(x: Value, y: Value, curves: Vec<Curve>) -> Plot {
    let layout = json!({ "xaxis": x, "yaxis": y, "hovermode": "closest" });
    Plot { data: curves.into_iter().map(Curve::trace).collect(), layout, motion: None }
}

fn axis(title: &str) -> Value {
    json!({ "title": { "text": title } })
}

/// With linear axes.
pub fn linear(x: &str, y: &str, curves: Vec<Curve>) -> Plot {
    plot(axis(x), axis(y), curves)
}

/// Over time, with a logarithmic axis of values; zeros, which have no logarithm, are left out.
pub fn over_time(y: &str, curves: Vec<Curve>) -> Plot {
    let curves: Vec<_> = curves.into_iter().map(Curve::without_zeros).collect();
    let y = logarithmic(axis(y), curves.iter().flat_map(|curve| &curve.y));
    plot(axis("time, s"), y, curves)
}

/// With logarithmic axes.
pub fn logarithms(x: &str, y: &str, curves: Vec<Curve>) -> Plot {
    let x = logarithmic(axis(x), curves.iter().flat_map(|curve| &curve.x));
    let y = logarithmic(axis(y), curves.iter().flat_map(|curve| &curve.y));
    plot(x, y, curves)
}

/// A logarithmic axis for values: marks at decades, if there are some.
fn logarithmic<'a>(mut axis: Value, values: impl Iterator<Item = &'a f64>) -> Value {
    let (low, high) = values
        .filter(|value| **value > 0.0)
        .fold((f64::INFINITY, 0.0_f64), |(low, high), value| (low.min(*value), high.max(*value)));
    axis["type"] = "log".into();
    if high > 30.0 * low {
        axis["dtick"] = 1.0.into();
    }
    axis
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_curve_is_a_trace_of_plotly() {
        let curve = Curve::new("error", vec![1.0, 2.0], vec![0.123_456_789, f64::NAN]).dashed(DashType::Dot);
        let bare = curve.clone().trace();
        assert_eq!((&bare["type"], &bare["mode"]), (&json!("scatter"), &json!("lines")));
        assert_eq!((&bare["y"], &bare["line"]["dash"]), (&json!([0.12346, null]), &json!("dot")));
        let points = curve.points().marked(MarkerSymbol::DiamondOpen).saying(vec!["a".into(), "b".into()]);
        let points = points.trace();
        assert_eq!((&points["mode"], &points["hovertext"]), (&json!("markers"), &json!(["a", "b"])));
        assert_eq!(points["marker"]["symbol"], "diamond-open");
    }

    #[test]
    fn zeros_have_no_logarithm_and_marks_stand_at_decades_if_there_are_some() {
        let axis_of = |y: Vec<f64>| {
            let plot = over_time("mm", vec![Curve::new("error", vec![1.0, 2.0, 3.0], y)]);
            (plot.data[0]["x"].clone(), plot.layout["yaxis"]["dtick"].clone())
        };
        assert_eq!(axis_of(vec![0.0, 1.0, 100.0]), (json!([2.0, 3.0]), json!(1.0)));
        assert_eq!(axis_of(vec![1.0, 2.0, 3.0]), (json!([1.0, 2.0, 3.0]), json!(null)));
    }

    #[test]
    fn numbers_are_short_and_right() {
        for (value, words) in [(0.0, "0.00"), (12.345, "12.3"), (1234.5, "1234"), (0.012345, "0.0123")] {
            assert_eq!(short(value), words);
        }
        assert_eq!(rounded(0.123_456_789), 0.123_46);
        assert!(rounded(f64::NAN).is_nan());
    }
}
