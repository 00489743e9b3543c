//! Rows for people and programs. Lengths in mm, times in microseconds; what a run that diverged did not
//! measure is left empty.

use std::format;
use std::iter;
use std::path::Path;
use std::string::String;
use std::vec::Vec;

use super::LabError;
use super::run::Row;
use crate::io::write_atomically;

/// Columns of the file.
pub const COLUMNS: [&str; 17] = [
    "scene",
    "method",
    "multiple",
    "mean_mm",
    "sd_mm",
    "max_mm",
    "mean_over_time_mm",
    "hold_mm",
    "skill",
    "clip_share",
    "us_per_step",
    "us_per_simulated_second",
    "step_over_limit_rest",
    "step_over_limit_trajectory",
    "status",
    "running_estimate_mm",
    "doubling_estimate_mm",
];

fn cells(row: &Row) -> [String; COLUMNS.len()] {
    let figures = row.figures();
    let length = |value: Option<f64>| value.map_or_else(String::new, |value| format!("{value:.6}"));
    let time = |value: Option<f64>| value.map_or_else(String::new, |value| format!("{value:.3}"));
    let errors = figures.map(|figures| &figures.errors);
    let us_per_step = figures.map(|figures| figures.us_per_step);
    [
        row.scene.into(),
        row.method.name().into(),
        format!("{}", row.multiple),
        length(errors.map(|errors| errors.mean())),
        length(errors.map(|errors| errors.sd)),
        length(errors.map(|errors| errors.max)),
        length(errors.map(|errors| errors.mean_over_time())),
        length(Some(row.hold)),
        length(errors.map(|errors| errors.skill(row.hold))),
        length(figures.map(|figures| figures.clip_share)),
        time(us_per_step),
        time(us_per_step.map(|time| time / row.step())),
        length(Some(row.step_over_limit_rest)),
        length(Some(row.step_over_limit_trajectory)),
        format!("{}", row.end),
        length(figures.and_then(|figures| figures.running)),
        length(row.doubling),
    ]
}

/// Writes the rows as comma-separated values under [`COLUMNS`].
pub fn write_csv(path: &Path, rows: &[Row]) -> Result<(), LabError> {
    write_atomically(path, |file| {
        writeln!(file, "{}", COLUMNS.join(","))?;
        rows.iter().try_for_each(|row| writeln!(file, "{}", cells(row).join(",")))
    })?;
    Ok(())
}

/// The rows as aligned text with the columns that matter most to people.
#[must_use]
pub fn text(rows: &[Row]) -> String {
    const HEADS: [&str; 9] =
        ["scene", "method", "multiple", "mean mm", "max mm", "over time mm", "skill", "us/step", "status"];
    let short = |row: &Row| {
        let errors = row.figures().map(|figures| &figures.errors);
        let number = |value: Option<f64>| value.map_or_else(|| "-".into(), |value| format!("{value:.4}"));
        [
            row.scene.into(),
            row.method.name().into(),
            format!("{}", row.multiple),
            number(errors.map(|errors| errors.mean())),
            number(errors.map(|errors| errors.max)),
            number(errors.map(|errors| errors.mean_over_time())),
            number(errors.map(|errors| errors.skill(row.hold))),
            row.figures().map_or_else(|| "-".into(), |figures| format!("{:.1}", figures.us_per_step)),
            format!("{}", row.end),
        ]
    };
    let lines: Vec<[String; HEADS.len()]> =
        iter::once(HEADS.map(String::from)).chain(rows.iter().map(short)).collect();
    let mut widths = [0; HEADS.len()];
    for line in &lines {
        for (width, cell) in widths.iter_mut().zip(line) {
            *width = cell.len().max(*width);
        }
    }
    let mut text = String::new();
    for line in &lines {
        for (column, (cell, width)) in line.iter().zip(widths).enumerate() {
            // Words to the left, numbers to the right.
            text += &match column {
                0 | 1 => format!("{cell:<width$}  "),
                8 => format!("{cell}\n"),
                _ => format!("{cell:>width$}  "),
            };
        }
    }
    text
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::lab::measure::Errors;
    use crate::lab::method::Method;
    use crate::lab::run::{End, Figures};
    use std::vec;

    fn rows() -> [Row; 2] {
        let errors = Errors { means: vec![1.0, 2.0], sd: 0.5, max: 4.0 };
        let figures = Figures { errors, running: Some(0.75), clip_share: 0.25, us_per_step: 150.0 };
        let row = Row {
            scene: "lobe",
            method: Method::TledLargeStep,
            multiple: 10,
            hold: 3.0,
            step_over_limit_rest: 1.5,
            step_over_limit_trajectory: 2.0,
            doubling: Some(1.25),
            end: End::Reached(figures),
        };
        [row.clone(), Row { doubling: None, end: End::Diverged(0.0126), ..row }]
    }

    #[test]
    fn a_file_has_the_figures_and_leaves_unknown_ones_empty() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("results.csv");
        write_csv(&path, &rows()).unwrap();
        let text = std::fs::read_to_string(path).unwrap();
        let lines: Vec<&str> = text.lines().collect();
        assert_eq!(lines[0], COLUMNS.join(","));
        let known = "lobe,tled-large-step,10,2.000000,0.500000,4.000000,1.500000,3.000000,0.500000,0.250000,\
                     150.000,500000.013,1.500000,2.000000,limited,0.750000,1.250000";
        assert_eq!(lines[1], known);
        let unknown = "lobe,tled-large-step,10,,,,,3.000000,,,,,1.500000,2.000000,diverged at 0.013 s,,";
        assert_eq!(lines[2], unknown);
    }

    #[test]
    fn columns_stand_below_their_heads() {
        let text = text(&rows());
        let ends: Vec<_> = text.lines().map(|line| line.find(['s', 'l', 'd']).unwrap()).collect();
        assert_eq!(ends, [0, 0, 0]);
        let status = text.lines().next().unwrap().find("status").unwrap();
        assert!(text.lines().nth(1).unwrap()[status..].starts_with("limited"));
        assert!(text.lines().nth(2).unwrap()[status..].starts_with("diverged"));
    }
}
