//! Measured displacements: a table of points with commas, one row for each point and time.
//!
//! | column | what |
//! |---|---|
//! | `x_m`, `y_m`, `z_m` | where the point is in the undeformed mesh, m |
//! | `ux_m`, `uy_m`, `uz_m` | its displacement, m; empty where it was not measured |
//! | `time_s` | when, s from the start of the scene; without the column at rest |
//! | `name` | of the point; without the column its place is its name |

use std::path::Path;

use crate::problem::Problem;

/// A row.
pub(crate) struct Sample {
    pub(crate) name: String,
    /// m.
    pub(crate) point: [f64; 3],
    /// m; none where it was not measured.
    pub(crate) displacement: [Option<f64>; 3],
    /// s; none at rest.
    pub(crate) time: Option<f64>,
}

const PLACE: [&str; 3] = ["x_m", "y_m", "z_m"];
const DISPLACEMENT: [&str; 3] = ["ux_m", "uy_m", "uz_m"];
const OTHERS: [&str; 2] = ["time_s", "name"];

/// Reads a table, which has at least one measured number.
pub(crate) fn read(path: &Path) -> Result<Vec<Sample>, Problem> {
    let text =
        supple::io::read_text(path).map_err(|error| Problem::in_file(path, format!("cannot be read: {error}")))?;
    let mut lines = text.lines().enumerate().filter(|(_, line)| !line.trim().is_empty());
    let (_, header) = lines.next().ok_or_else(|| Problem::in_file(path, "the file is empty"))?;
    let names: Vec<&str> = header.split(',').map(str::trim).collect();
    let known = || PLACE.into_iter().chain(DISPLACEMENT).chain(OTHERS);
    if let Some(unknown) = names.iter().find(|name| !known().any(|known| known == **name)) {
        let all = known().collect::<Vec<_>>().join(", ");
        return Err(Problem::in_file(path, format!("line 1: the column \"{unknown}\" is not known; there are {all}")));
    }
    let place = |wanted: &str| names.iter().position(|name| *name == wanted);
    let required = |wanted: &'static str| {
        place(wanted).ok_or_else(|| Problem::in_file(path, format!("line 1: the column {wanted} is missing")))
    };
    let [x, y, z] = PLACE.map(required);
    let [ux, uy, uz] = DISPLACEMENT.map(required);
    let (point, displacement) = ([x?, y?, z?], [ux?, uy?, uz?]);
    let (time, name) = (place("time_s"), place("name"));
    let mut samples = vec![];
    for (index, line) in lines {
        let cells: Vec<&str> = line.split(',').map(str::trim).collect();
        let problem = |message: String| Problem::in_file(path, format!("line {}: {message}", index + 1));
        if cells.len() != names.len() {
            return Err(problem(format!("{} values, the first line has {} columns", cells.len(), names.len())));
        }
        let number = |column: usize| match cells[column].parse::<f64>() {
            Ok(value) if value.is_finite() => Ok(value),
            _ => Err(problem(format!("{} is \"{}\", it must be a number", names[column], cells[column]))),
        };
        let maybe = |column: usize| if cells[column].is_empty() { Ok(None) } else { number(column).map(Some) };
        let [x, y, z] = point.map(number);
        let [ux, uy, uz] = displacement.map(maybe);
        let (point, time) = ([x?, y?, z?], time.map(number).transpose()?);
        if let Some(time) = time.filter(|time| *time < 0.0) {
            return Err(problem(format!("time_s is {time}, it must be zero or more: the scene starts at 0")));
        }
        let mm = point.map(|metre| (1e4 * metre).round() / 10.0);
        let name = name.map_or_else(|| format!("({}, {}, {}) mm", mm[0], mm[1], mm[2]), |name| cells[name].to_owned());
        samples.push(Sample { name, point, displacement: [ux?, uy?, uz?], time });
    }
    if samples.iter().all(|sample| sample.displacement.iter().all(Option::is_none)) {
        return Err(Problem::in_file(path, "the file holds no measured displacement"));
    }
    Ok(samples)
}
