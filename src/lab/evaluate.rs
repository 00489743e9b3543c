//! An evaluation: methods over scenes at multiples of a scene's step, and of one of them at more: a sweep.

use std::path::Path;

use super::method::Method;
use super::run::{self, Row};
use super::scenes::{self, SceneSpec};
use super::truth::{self, Truth};
use super::{LabError, MULTIPLES, sweep, table};

/// The scene of the sweep unless another is asked for.
const SWEPT: &str = "reversed";

/// What to evaluate.
#[derive(Clone, Debug)]
pub struct Plan {
    /// Scenes with the multiples at which methods are run on them.
    pub scenes: Vec<(SceneSpec, Vec<u32>)>,
    /// Methods.
    pub methods: Vec<Method>,
    /// The scene whose errors are drawn over the step.
    pub sweep: Option<String>,
}

impl Plan {
    /// A plan from names, of scenes also of the groups `ramped` and `moving`; an empty list stands for all there are,
    /// of methods all but [`Method::SLOW`] and [`Method::HARD`]. The scene of the sweep is run at [`sweep::MULTIPLES`]
    /// too. Without a name it is `reversed`, if that is among the scenes.
    pub fn new(
        scenes: &[String],
        methods: &[String],
        multiples: &[u32],
        sweep: Option<&str>,
    ) -> Result<Self, LabError> {
        let mut names = unique(scenes.iter().flat_map(|name| scenes::of_group(name)));
        if names.is_empty() {
            names = scenes::names().collect();
        }
        let methods: Vec<Method> = match methods {
            [] => Method::ALL
                .into_iter()
                .filter(|method| !Method::SLOW.contains(method) && !Method::HARD.contains(method))
                .collect(),
            names => names.iter().map(|name| Method::named(name)).collect::<Result<_, _>>()?,
        };
        let multiples = if multiples.is_empty() { &MULTIPLES } else { multiples };
        let sweep = sweep.or_else(|| names.contains(&SWEPT).then_some(SWEPT));
        let mut plan = Self { scenes: Vec::new(), methods: unique(methods), sweep: sweep.map(String::from) };
        for name in unique(names.iter().copied().chain(sweep)) {
            let asked = if names.contains(&name) { multiples } else { &[] };
            let swept: &[u32] = if sweep == Some(name) { &sweep::MULTIPLES } else { &[] };
            let mut all = [asked, swept].concat();
            all.sort_unstable();
            all.dedup();
            let scene = scenes::named(name)?;
            all.iter().try_for_each(|&multiple| scene.check_multiple(multiple))?;
            plan.scenes.push((scene, all));
        }
        Ok(plan)
    }
}

/// Each item once, in the order in which they come first.
pub fn unique<T: PartialEq>(items: impl IntoIterator<Item = T>) -> Vec<T> {
    let mut seen = Vec::new();
    for item in items {
        if !seen.contains(&item) {
            seen.push(item);
        }
    }
    seen
}

/// What an evaluation came to.
#[derive(Clone, Debug)]
pub struct Evaluation {
    /// The scenes with their exact motions.
    pub scenes: Vec<(SceneSpec, Truth)>,
    /// The runs, scene by scene.
    pub rows: Vec<Row>,
}

/// Carries the plan out: truths in `out/truth/`, rows in `out/results.csv`; files of an earlier evaluation are
/// replaced. `say` is given the progress in words.
pub fn evaluate(plan: &Plan, out: &Path, mut say: impl FnMut(&str)) -> Result<Evaluation, LabError> {
    super::create_folder(out)?;
    let (specs, multiples): (Vec<_>, Vec<_>) = plan.scenes.iter().cloned().unzip();
    let scenes = truth::obtain(&specs, &out.join("truth"), |spec, truth| say(&about(spec, truth)))?;
    let mut rows = Vec::new();
    for ((spec, truth), multiples) in scenes.iter().zip(multiples) {
        for method in &plan.methods {
            say(&format!("{}: {}", spec.name, method.name()));
            for multiple in method.multiples(&spec.timing, &multiples) {
                rows.push(run::run(spec, truth, *method, multiple)?);
            }
        }
    }
    table::write_csv(&out.join("results.csv"), &rows)?;
    Ok(Evaluation { scenes, rows })
}

fn about(spec: &SceneSpec, truth: &Truth) -> String {
    let Truth { limit_at_rest, limit_least, limit_least_time, limited_steps, .. } = truth;
    let limited = if *limited_steps > 0 { format!("; {limited_steps} steps limited") } else { String::new() };
    format!(
        "{}: truth moves by {:.1} mm; stable below {limit_at_rest:.3e} s at rest, {limit_least:.3e} s at \
         {limit_least_time:.2} s{limited}",
        spec.name,
        1e3 * truth.most(),
    )
}
