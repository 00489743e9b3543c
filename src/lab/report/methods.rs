//! Methods judged against the exact motion: speed against error with the Pareto front, error over step and over time,
//! and the two figures of the paper.

use crate::evaluate::{Evaluation, unique};
use crate::method::Method;
use crate::networks::Family;
use crate::run::{End, Figures, Row};
use crate::scenes::SceneSpec;
use crate::sweep;
use crate::truth::Truth;
use crate::{DT, MULTIPLES};
use supple::mesh::boundary;
use supple_cli::report::bodies::{Bodies, View, distances, lengths, mean_millimetres, moved};
use supple_cli::report::made::Made;
use supple_cli::report::plots::{self, COLOURS, Curve, DashType, GREY, MarkerSymbol, Plot, short};
use supple_cli::report::{Figure, Panel, ReportPart, Section, Table};

use super::peers::{BAR, NETWORK_SECONDS, PEERS, PUBLISHED};

pub(crate) const NAME: &str = "methods";

/// Methods of the evaluation, in their order.
fn methods(rows: &[Row]) -> Vec<Method> {
    unique(rows.iter().map(|row| row.method))
}

/// The part of an evaluation; `swept` is the scene whose errors are drawn over the step.
pub(crate) fn part(evaluation: &Evaluation, swept: Option<&str>) -> ReportPart {
    let mut sections = vec![speed(evaluation), over_time(evaluation)];
    sections.extend(swept.and_then(|scene| over_step(evaluation, scene)));
    sections.extend(paper_bars(evaluation));
    sections.extend(paper_bodies(evaluation));
    let seeds = "none: the runs of a scene are the same each time, but for their computing times";
    ReportPart { made: Made::by_this_command(seeds), sections }
}

fn colour(methods: &[Method], method: Method) -> &'static str {
    COLOURS[methods.iter().position(|of| *of == method).unwrap_or(0) % COLOURS.len()]
}

/// Its error over time, mm, and computing time of a simulated second, s.
fn point(row: &Row, figures: &Figures) -> (f64, f64) {
    (figures.errors.mean_over_time(), 1e-6 * figures.us_per_step / row.step)
}

/// What moves nothing, and exact steps, have no error over their step.
const fn is_reference(method: Method) -> bool {
    matches!(method, Method::Tled | Method::Hold)
}

fn speed(evaluation: &Evaluation) -> Section {
    let methods = methods(&evaluation.rows);
    let panels = evaluation.scenes.iter().map(|(spec, truth)| {
        let rows: Vec<&Row> = evaluation.rows.iter().filter(|row| row.scene == spec.name).collect();
        let name = format!("{} (moves by {:.0} mm)", spec.name, 1e3 * truth.most());
        Panel::new(name, speed_of(spec, &rows, &methods))
    });
    let caption = "A point is one step of one method: its computing time on one core, and its mean error over nodes and time; to the lower left is \
                   better. Exact steps are the reference and have no error: they stand at the foot of the plot, at their time, and so do other programs' \
                   exact steps (measured on another machine, carried over by the ratio to plain code). The dotted stairs are the Pareto front of the methods here: no other \
                   point is faster and nearer. Squares: the paper's networks, errors as published (at 1.0 s), time measured with ONNX Runtime on another machine. \
                   Left of the grey line a method is faster than real time. Runs that diverged have no point; the table counts them.";
    Section {
        title: "Speed against error".into(),
        paragraphs: vec![
            "Error is the distance to the exact motion on the same mesh, so it does not contain the error of the mesh and of the element, which is measured \
             against nature. It stands next to the error of a body that never moves."
                .into(),
        ],
        tables: vec![summary(evaluation, &methods)],
        figures: vec![Figure::choice(caption, panels.collect())],
        ..Section::default()
    }
}

/// The plot of one scene.
fn speed_of(spec: &SceneSpec, rows: &[&Row], methods: &[Method]) -> Plot {
    let ended = rows.iter().filter_map(|row| Some((*row, point(row, row.figures()?))));
    let judged: Vec<(&Row, (f64, f64))> =
        ended.filter(|(row, (error, _))| !is_reference(row.method) && *error > 0.0).collect();
    let hold = rows.first().map_or(f64::NAN, |row| row.hold);
    let least = judged.iter().map(|(_, (error, _))| *error).fold(hold, f64::min);
    // Where what has no error stands.
    let foot = 0.3 * least;
    let mut curves = vec![];
    for &method in methods {
        let of: Vec<_> = judged.iter().filter(|(row, _)| row.method == method).collect();
        if of.is_empty() {
            continue;
        }
        let words = of.iter().map(|(row, (error, time))| {
            format!(
                "{}, {}x the scene's step ({:.1}x the limit of stability)<br>{} mm of {} mm, {} s a simulated second<br>{}",
                method.name(),
                row.multiple,
                row.step_over_limit_trajectory,
                short(*error),
                short(row.hold),
                short(*time),
                row.end
            )
        });
        let (x, y) = of.iter().map(|(_, (error, time))| (*time, *error)).unzip();
        let curve = Curve::new(method.name(), x, y).coloured(colour(methods, method));
        curves.push(curve.marked(MarkerSymbol::Circle).saying(words.collect()));
    }
    curves.extend(front(&judged));
    let exact = rows.iter().find(|row| row.method == Method::Tled).and_then(|row| Some(point(row, row.figures()?)));
    let times = judged.iter().map(|(_, (_, time))| *time).chain(exact.map(|(_, time)| time));
    let (mut low, mut high) = times.fold((1.0_f64, 1.0_f64), |(low, high), time| (low.min(time), high.max(time)));
    if let Some((_, time)) = exact {
        let curve = Curve::new("exact (reference)", vec![time], vec![foot]).points().marked(MarkerSymbol::Diamond);
        curves.push(curve.coloured(GREY).saying(vec![format!("exact steps: {} s a simulated second", short(time))]));
        if (spec.points.len(), spec.tets.len()) == BAR {
            let peers = peers(time, foot);
            high = high.max(2.0 * NETWORK_SECONDS / f64::from(10.0 * DT));
            curves.extend(peers);
        }
    }
    (low, high) = (0.7 * low, 1.4 * high);
    let line = |name: &str, x: [f64; 2], y: [f64; 2], dash| {
        Curve::new(name, x.to_vec(), y.to_vec()).coloured(GREY).dashed(dash)
    };
    curves.push(line("standing still", [low, high], [hold; 2], DashType::Dash));
    curves.push(line("real time", [1.0; 2], [foot, 2.0 * hold], DashType::Solid));
    plots::logarithms("computing time of a simulated second, s", "mean error, mm", curves)
}

/// Points of which none other is both faster and nearer, from the fastest on.
fn front(judged: &[(&Row, (f64, f64))]) -> Option<Curve> {
    let mut points: Vec<(f64, f64)> = judged.iter().map(|(_, (error, time))| (*time, *error)).collect();
    points.sort_by(|a, b| a.0.total_cmp(&b.0));
    let mut least = f64::INFINITY;
    points.retain(|(_, error)| {
        let is_nearer = *error < least;
        least = least.min(*error);
        is_nearer
    });
    let (x, y): (Vec<_>, Vec<_>) = points.into_iter().unzip();
    (!x.is_empty()).then(|| Curve::new("Pareto front", x, y).coloured(GREY).dashed(DashType::Dot).stairs())
}

/// Other programs on the bar, where the exact step takes `exact` s for a simulated second.
fn peers(exact: f64, foot: f64) -> [Curve; 2] {
    let times: Vec<f64> = PEERS.iter().map(|peer| exact * peer.ratio()).collect();
    let words = PEERS.iter().zip(&times).map(|(peer, time)| {
        format!(
            "{}: exact steps, {:.1} times ours, {} s a simulated second<br>measured on another machine",
            peer.name,
            peer.ratio(),
            short(*time)
        )
    });
    let steps = Curve::new("other programs, exact (measured)", times.clone(), vec![foot; times.len()])
        .points()
        .marked(MarkerSymbol::DiamondOpen)
        .coloured(GREY)
        .saying(words.collect());
    let seconds = PUBLISHED.map(|(multiple, _)| NETWORK_SECONDS / f64::from(multiple as f32 * DT));
    let words = PUBLISHED.iter().zip(seconds).map(|((multiple, error), seconds)| {
        format!(
            "the paper's network at {multiple}x: {error} mm at 1.0 s (published)<br>{} s a simulated second (measured with ONNX Runtime)",
            short(seconds)
        )
    });
    let errors = PUBLISHED.map(|(_, error)| error).to_vec();
    let networks = Curve::new("the paper's networks (published)", seconds.to_vec(), errors)
        .points()
        .marked(MarkerSymbol::SquareOpen)
        .coloured(GREY)
        .saying(words.collect());
    [steps, networks]
}

/// Methods and their steps over all scenes.
fn summary(evaluation: &Evaluation, methods: &[Method]) -> Table {
    let mut rows = vec![];
    for &method in methods.iter().filter(|method| !is_reference(**method)) {
        for multiple in MULTIPLES {
            let of: Vec<&Row> =
                evaluation.rows.iter().filter(|row| (row.method, row.multiple) == (method, multiple)).collect();
            if of.is_empty() {
                continue;
            }
            let ended: Vec<(&Row, (f64, f64))> =
                of.iter().filter_map(|row| Some((*row, point(row, row.figures()?)))).collect();
            let median = |values: Vec<f64>| middle(values).map_or_else(|| "-".into(), short);
            let worst = ended.iter().max_by(|a, b| (a.1.0 / a.0.hold).total_cmp(&(b.1.0 / b.0.hold)));
            rows.push(vec![
                method.name().into(),
                multiple.to_string(),
                of.len().to_string(),
                median(ended.iter().map(|(row, (error, _))| 100.0 * error / row.hold).collect()),
                worst.map_or_else(
                    || "-".into(),
                    |(row, (error, _))| format!("{} ({})", short(100.0 * error / row.hold), row.scene),
                ),
                median(ended.iter().map(|(_, (error, _))| *error).collect()),
                median(ended.iter().map(|(_, (_, time))| *time).collect()),
                of.iter().filter(|row| matches!(row.end, End::Diverged(_))).count().to_string(),
            ]);
        }
    }
    let heads = [
        "method",
        "step, multiple of the scene's",
        "scenes",
        "median error, % of standing still",
        "worst, % (scene)",
        "median error, mm",
        "median computing time of a simulated second, s",
        "diverged",
    ];
    Table { title: "methods and their steps over all scenes".into(), heads: heads.map(String::from).to_vec(), rows }
}

fn middle(mut values: Vec<f64>) -> Option<f64> {
    values.sort_by(f64::total_cmp);
    values.get(values.len() / 2).copied()
}

fn over_time(evaluation: &Evaluation) -> Section {
    let methods = methods(&evaluation.rows);
    let mut panels = vec![];
    for (spec, truth) in &evaluation.scenes {
        let times: Vec<f64> =
            (1..=truth.snapshots.len()).map(|count| count as f64 * spec.timing.interval_seconds()).collect();
        let still: Vec<f64> = truth.snapshots.iter().map(|shape| mean_millimetres(&lengths(shape))).collect();
        let rows: Vec<&Row> = evaluation
            .rows
            .iter()
            .filter(|row| row.scene == spec.name && !is_reference(row.method) && !row.frames.is_empty())
            .collect();
        for multiple in MULTIPLES.into_iter().filter(|multiple| rows.iter().any(|row| row.multiple == *multiple)) {
            let still =
                Curve::new("standing still", times.clone(), still.clone()).coloured(GREY).dashed(DashType::Dash);
            let curves = rows.iter().filter(|row| row.multiple == multiple).map(|row| {
                let errors = row.frames.iter().map(|frame| frame.mean).collect();
                Curve::new(row.method.name(), times[..row.frames.len()].to_vec(), errors)
                    .coloured(colour(&methods, row.method))
            });
            let plot = plots::over_time("mean error of the nodes, mm", curves.chain([still]).collect());
            panels.push(Panel::new(format!("{}, {multiple}x", spec.name), plot));
        }
    }
    let caption = "Mean error over the nodes at each snapshot, next to that of a body that never moves. A curve that ends early diverged. Estimates of the error while running \
                   are in the part on hard cases.";
    Section { title: "Error over time".into(), figures: vec![Figure::choice(caption, panels)], ..Section::default() }
}

fn over_step(evaluation: &Evaluation, scene: &str) -> Option<Section> {
    let methods = methods(&evaluation.rows);
    let curves = sweep::curves(&evaluation.rows, scene);
    let hold = evaluation.rows.iter().find(|row| row.scene == scene)?.hold;
    let mut drawn = vec![];
    let mut words = vec![];
    for curve in &curves {
        let method = methods.iter().find(|method| method.name() == curve.name)?;
        let (x, y) = curve.points.iter().copied().unzip();
        let slope = curve.slope().map_or_else(|| "no slope".into(), |slope| format!("slope {slope:.2}"));
        drawn.push(
            Curve::new(format!("{}, {slope}", curve.name), x, y)
                .coloured(colour(&methods, *method))
                .marked(MarkerSymbol::Circle),
        );
        if !curve.diverged.is_empty() {
            let at: Vec<_> = curve.diverged.iter().map(|multiple| format!("{multiple}x")).collect();
            words.push(format!("{} diverged at {}.", curve.name, at.join(", ")));
        }
    }
    if drawn.is_empty() {
        return None;
    }
    let still = Curve::new("standing still", vec![1.0, 250.0], vec![hold; 2]).coloured(GREY).dashed(DashType::Dash);
    drawn.push(still);
    let plot = plots::logarithms("step, multiples of the scene's", "mean error, mm", drawn);
    let caption = format!(
        "Mean error over nodes and time in the scene {scene}, with the slope of its logarithm. {}",
        words.join(" ")
    );
    Some(Section {
        title: "Error over step".into(),
        figures: vec![Figure::choice(caption, vec![Panel::new(scene, plot)])],
        ..Section::default()
    })
}

/// The motions of the paper's figure of bars, and its multiples.
const BARS: [&str; 4] = ["reversed", "stretch", "compression", "compression-neo-hookean"];
const BAR_MULTIPLES: [u32; 2] = [10, 20];
/// Of its figure of other bodies.
const BODIES: [&str; 2] = ["cylinder", "lobe"];
const BODY_MULTIPLES: [u32; 4] = [10, 20, 50, 100];
/// Whose shapes are shown: the paper's network, the compact one, and the long step.
const SHOWN: [Method; 3] = [Method::Learned(Family::Paper), Method::Learned(Family::Compact), Method::Long];

fn find<'a>(
    evaluation: &'a Evaluation,
    scene: &str,
    method: Method,
    multiple: u32,
) -> Option<(&'a SceneSpec, &'a Truth, &'a Row)> {
    let (spec, truth) = evaluation.scenes.iter().find(|(spec, _)| spec.name == scene)?;
    let row =
        evaluation.rows.iter().find(|row| row.scene == scene && row.method == method && row.multiple == multiple)?;
    (row.figures().is_some() && !row.shape.is_empty()).then_some((spec, truth, row))
}

/// What a hundredth of the values exceeds, so that one node does not take the colours of all others.
fn most_but_a_hundredth(mut values: Vec<f64>) -> f64 {
    values.sort_by(f64::total_cmp);
    values.get(values.len() * 99 / 100).copied().unwrap_or_default().max(1e-6)
}

/// "0.017 +- 0.014 (0.032) mm", as the paper writes it.
fn spread(row: &Row) -> String {
    row.figures().map_or_else(String::new, |Figures { errors, .. }| {
        format!("{} \u{b1} {} ({}) mm", short(errors.mean()), short(errors.sd), short(errors.max))
    })
}

/// Point-to-point distance on the deformed bar.
fn paper_bars(evaluation: &Evaluation) -> Option<Section> {
    let mut figures = vec![];
    for method in SHOWN {
        let runs = BAR_MULTIPLES.iter().flat_map(|multiple| {
            BARS.iter().filter_map(|scene| {
                let (spec, truth, row) = find(evaluation, scene, method, *multiple)?;
                Some((spec, row, distances(&row.shape, truth.snapshots.last()?)))
            })
        });
        let runs: Vec<_> = runs.collect();
        if runs.is_empty() {
            continue;
        }
        let most = most_but_a_hundredth(runs.iter().flat_map(|(.., distances)| distances).copied().collect());
        let panels = runs.iter().map(|(spec, row, distances)| {
            let mut bodies = Bodies::default();
            let positions = moved(&spec.points, &row.shape);
            bodies.add(&positions, &boundary(spec.tets.iter().copied()), distances, most);
            Panel::new(format!("{}, {}x: {}", row.scene, row.multiple, spread(row)), bodies.plot(View::Lying))
        });
        let columns = runs.len().min(BARS.len());
        let caption = format!(
            "{}: point-to-point distance to the exact motion at the end on the deformed bar, as in the paper's first figure; mean \u{b1} standard deviation (largest) \
             over the nodes. A hundredth of the nodes may be above the scale. Turn one bar and all turn.",
            method.name()
        );
        figures.push(Figure::grid(caption, panels.collect(), columns, 1e3 * most, "distance to the exact motion"));
    }
    let title = "The paper's bar: four motions at 10 and 20 times its step".into();
    (!figures.is_empty()).then(|| Section { title, figures, ..Section::default() })
}

/// Cylinder and lobe next to the exact motion, in the same colours.
fn paper_bodies(evaluation: &Evaluation) -> Option<Section> {
    let mut figures = vec![];
    for method in SHOWN {
        for scene in BODIES {
            let runs = BODY_MULTIPLES.iter().filter_map(|multiple| find(evaluation, scene, method, *multiple));
            let runs: Vec<_> = runs.collect();
            let Some((spec, exact)) = runs.first().and_then(|(spec, truth, _)| Some((spec, truth.snapshots.last()?)))
            else {
                continue;
            };
            let most = lengths(exact).into_iter().fold(1e-6, f64::max);
            let triangles = boundary(spec.tets.iter().copied());
            let panel = |name: String, shape: &[[f32; 3]]| {
                let mut bodies = Bodies::default();
                bodies.add(&moved(&spec.points, shape), &triangles, &lengths(shape), most);
                Panel::new(name, bodies.plot(View::Standing))
            };
            let others =
                runs.iter().map(|(_, _, row)| panel(format!("{}x: {}", row.multiple, spread(row)), &row.shape));
            let panels: Vec<_> = std::iter::once(panel("exact".into(), exact)).chain(others).collect();
            let columns = panels.len();
            let caption = format!(
                "{}: the {scene} at the end next to the exact motion, as in the paper's second figure, coloured by displacement; mean \u{b1} standard deviation (largest) of the distance to it.",
                method.name()
            );
            figures.push(Figure::grid(caption, panels, columns, 1e3 * most, "displacement"));
        }
    }
    let title = "Other bodies at 10, 20, 50 and 100 times the paper's step".into();
    (!figures.is_empty()).then(|| Section { title, figures, ..Section::default() })
}

#[cfg(test)]
mod tests {
    use super::*;

    const fn row(end: End) -> Row {
        Row {
            scene: "lobe",
            method: Method::Long,
            multiple: 10,
            step: 3e-4,
            hold: 3.0,
            hold_at_end: 3.5,
            step_over_limit_rest: 1.5,
            step_over_limit_trajectory: 2.0,
            frames: vec![],
            shape: vec![],
            end,
        }
    }

    #[test]
    fn a_front_has_no_point_that_another_beats() {
        let row = row(End::Diverged(0.0));
        // Error and time.
        let points = [(1.0, 1.0), (0.5, 2.0), (0.7, 3.0), (0.1, 4.0), (0.1, 5.0), (2.0, 0.5)];
        let judged: Vec<_> = points.into_iter().map(|point| (&row, point)).collect();
        let plot = plots::linear("s", "mm", vec![front(&judged).unwrap()]);
        assert_eq!(plot.data[0]["x"], serde_json::json!([0.5, 1.0, 2.0, 4.0]));
        assert_eq!(plot.data[0]["y"], serde_json::json!([2.0, 1.0, 0.5, 0.1]));
    }

    #[test]
    fn errors_are_written_as_the_paper_writes_them() {
        let errors = crate::measure::Errors { means: vec![9.0, 0.017], sd: 0.014, max: 0.032 };
        let figures = Figures { errors, clip_share: 0.0, us_per_step: 1.0 };
        let row = row(End::Reached(figures));
        assert_eq!(spread(&row), "0.0170 \u{b1} 0.0140 (0.0320) mm");
    }
}
