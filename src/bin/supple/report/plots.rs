//! Plots of curves and points over two axes, linear or logarithmic. Numbers have five digits: what an eye can see, in a quarter of the
//! bytes.

pub use plotly::Plot;
pub use plotly::common::{DashType, MarkerSymbol};
use plotly::common::{HoverInfo, Line, LineShape, Marker, Mode, Title};
use plotly::layout::{Axis, AxisType, HoverMode};
use plotly::{Layout, Scatter};

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

    fn trace(self) -> Box<Scatter<f64, f64>> {
        let rounded = |values: Vec<f64>| values.into_iter().map(rounded).collect();
        let mode = match (self.is_line, self.symbol.is_some()) {
            (true, true) => Mode::LinesMarkers,
            (false, _) => Mode::Markers,
            (true, false) => Mode::Lines,
        };
        let shape = if self.is_stairs { LineShape::Hv } else { LineShape::Linear };
        let line = Line::new().color(self.colour.clone()).dash(self.dash).width(1.8).shape(shape);
        let marker =
            Marker::new().color(self.colour).size(8).symbol(self.symbol.unwrap_or(MarkerSymbol::Circle));
        let trace = Scatter::new(rounded(self.x), rounded(self.y))
            .name(self.name)
            .mode(mode)
            .line(line)
            .marker(marker);
        if self.words.is_empty() {
            return trace;
        }
        trace.hover_text_array(self.words).hover_info(HoverInfo::Text)
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

fn plot(x: Axis, y: Axis, curves: Vec<Curve>) -> Plot {
    let mut plot = Plot::new();
    for curve in curves {
        plot.add_trace(curve.trace());
    }
    plot.set_layout(Layout::new().x_axis(x).y_axis(y).hover_mode(HoverMode::Closest));
    plot
}

fn axis(title: &str) -> Axis {
    Axis::new().title(Title::with_text(title))
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
fn logarithmic<'a>(axis: Axis, values: impl Iterator<Item = &'a f64>) -> Axis {
    let (low, high) = values
        .filter(|value| **value > 0.0)
        .fold((f64::INFINITY, 0.0_f64), |(low, high), value| (low.min(*value), high.max(*value)));
    let axis = axis.type_(AxisType::Log);
    if high > 30.0 * low { axis.dtick(1.0) } else { axis }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_are_short_and_right() {
        for (value, words) in [(0.0, "0.00"), (12.345, "12.3"), (1234.5, "1234"), (0.012345, "0.0123")] {
            assert_eq!(short(value), words);
        }
        assert_eq!(rounded(0.123_456_789), 0.123_46);
        assert!(rounded(f64::NAN).is_nan());
    }
}
