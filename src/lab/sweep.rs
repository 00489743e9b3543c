//! Error over step: on one scene, how fast does a method's error grow with its step, and where does it
//! diverge?

use super::method::Method;
use super::run::{End, Row};
use super::timing::Timing;

/// Multiples of a scene's step in a sweep. Each divides the steps of an interval of any scene.
pub const MULTIPLES: [u32; 8] = [1, 2, 5, 10, 20, 50, 100, 200];

/// A method's errors over its steps.
#[derive(Clone, Debug, PartialEq)]
pub struct Curve {
    /// The method's name.
    pub name: &'static str,
    /// Multiples of the step with the mean error over time (mm).
    pub points: Vec<(f64, f64)>,
    /// Multiples at which the method diverged.
    pub diverged: Vec<f64>,
}

impl Curve {
    /// The exponent `p` in `error = c step^p`, by least squares over the logarithms; none from fewer than two
    /// points.
    #[must_use]
    pub fn slope(&self) -> Option<f64> {
        let points: Vec<(f64, f64)> = self.points.iter().map(|(x, y)| (x.ln(), y.ln())).collect();
        let count = points.len() as f64;
        let mean_x = points.iter().map(|(x, _)| x).sum::<f64>() / count;
        let mean_y = points.iter().map(|(_, y)| y).sum::<f64>() / count;
        let (mut xx, mut xy) = (0.0, 0.0);
        for (x, y) in points {
            xx += (x - mean_x) * (x - mean_x);
            xy += (x - mean_x) * (y - mean_y);
        }
        (xx > 0.0).then(|| xy / xx)
    }
}

/// The curves of the methods in the rows of `scene` at [`MULTIPLES`]. Methods that run at one step only
/// have none.
#[must_use]
pub fn curves(rows: &[Row], scene: &str) -> Vec<Curve> {
    let stepped = Method::ALL.into_iter().filter(|method| !method.multiples(&Timing::PAPER, &[2]).contains(&1));
    let curve = |method: Method| {
        let mut curve = Curve { name: method.name(), points: Vec::new(), diverged: Vec::new() };
        for row in rows {
            if row.scene != scene || row.method != method || !MULTIPLES.contains(&row.multiple) {
                continue;
            }
            let multiple = f64::from(row.multiple);
            match &row.end {
                End::Diverged(_) => curve.diverged.push(multiple),
                // An error of zero has no logarithm.
                End::Reached(figures) if figures.errors.mean_over_time() > 0.0 => {
                    curve.points.push((multiple, figures.errors.mean_over_time()));
                }
                End::Reached(_) => {}
            }
        }
        curve
    };
    stepped.map(curve).filter(|curve| !curve.points.is_empty() || !curve.diverged.is_empty()).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn curve(points: Vec<(f64, f64)>) -> Curve {
        Curve { name: "a", points, diverged: vec![] }
    }

    #[test]
    fn the_slope_of_a_power_is_its_exponent() {
        let points = MULTIPLES.map(|multiple| (f64::from(multiple), 3e-4 * f64::from(multiple).powf(1.7)));
        assert!((curve(points.to_vec()).slope().unwrap() - 1.7).abs() < 1e-12);
        // Two decades up over two decades, seen through noise that cancels.
        let noisy = vec![(1.0, 1.1), (1.0, 1.0 / 1.1), (100.0, 100.0)];
        assert!((curve(noisy).slope().unwrap() - 1.0).abs() < 1e-12);
    }

    #[test]
    fn fewer_than_two_steps_have_no_slope() {
        assert_eq!(curve(vec![]).slope(), None);
        assert_eq!(curve(vec![(2.0, 1.0)]).slope(), None);
        assert_eq!(curve(vec![(2.0, 1.0), (2.0, 3.0)]).slope(), None);
    }
}
