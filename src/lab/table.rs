//! Rows for people and programs. Lengths in mm, times in microseconds; what a run that diverged did not
//! measure is left empty.

use std::iter;
use std::path::Path;

use supple::io::write_atomically;

use super::LabError;
use super::measure::Errors;
use super::run::Row;

/// A column: its head and what stands in it.
type Column = (&'static str, fn(&Row) -> String);

/// Of the file.
const COLUMNS: [Column; 16] = [
    ("scene", |row| row.scene.into()),
    ("method", |row| row.method.name().into()),
    ("multiple", |row| format!("{}", row.multiple)),
    ("mean_mm", |row| length(error(row, Errors::mean))),
    ("sd_mm", |row| length(error(row, |errors| errors.sd))),
    ("max_mm", |row| length(error(row, |errors| errors.max))),
    ("mean_over_time_mm", |row| length(error(row, Errors::mean_over_time))),
    ("hold_mm", |row| length(Some(row.hold))),
    ("skill", |row| length(skill(row))),
    ("clip_share", |row| length(row.figures().map(|figures| figures.clip_share))),
    ("us_per_step", |row| time(row.figures().map(|figures| figures.us_per_step))),
    ("us_per_simulated_second", |row| time(row.figures().map(|figures| figures.us_per_step / row.step))),
    ("step_over_limit_rest", |row| length(Some(row.step_over_limit_rest))),
    ("step_over_limit_trajectory", |row| length(Some(row.step_over_limit_trajectory))),
    ("status", |row| format!("{}", row.end)),
    ("hold_at_end_mm", |row| length(Some(row.hold_at_end))),
];

/// Of the text: those that matter most to people. `kappa` is the step over the critical one, at rest and where that is
/// least along the motion.
const TEXT_COLUMNS: [Column; 12] = [
    ("scene", |row| row.scene.into()),
    ("method", |row| row.method.name().into()),
    ("multiple", |row| format!("{}", row.multiple)),
    ("kappa rest", |row| format!("{:.2}", row.step_over_limit_rest)),
    ("kappa most", |row| format!("{:.2}", row.step_over_limit_trajectory)),
    ("mean mm", |row| short(error(row, Errors::mean))),
    ("max mm", |row| short(error(row, |errors| errors.max))),
    ("over time mm", |row| short(error(row, Errors::mean_over_time))),
    ("hold mm", |row| short(Some(row.hold))),
    ("skill", |row| short(skill(row))),
    ("us/step", |row| row.figures().map_or_else(|| "-".into(), |figures| format!("{:.1}", figures.us_per_step))),
    ("status", |row| format!("{}", row.end)),
];

fn error(row: &Row, figure: fn(&Errors) -> f64) -> Option<f64> {
    row.figures().map(|figures| figure(&figures.errors))
}

fn skill(row: &Row) -> Option<f64> {
    row.figures().map(|figures| figures.errors.skill(row.hold))
}

fn length(value: Option<f64>) -> String {
    value.map_or_else(String::new, |value| format!("{value:.6}"))
}

fn time(value: Option<f64>) -> String {
    value.map_or_else(String::new, |value| format!("{value:.3}"))
}

fn short(value: Option<f64>) -> String {
    value.map_or_else(|| "-".into(), |value| format!("{value:.4}"))
}

/// Writes the rows as comma-separated values under a line of heads.
pub fn write_csv(path: &Path, rows: &[Row]) -> Result<(), LabError> {
    write_atomically(path, |file| {
        writeln!(file, "{}", COLUMNS.map(|(head, _)| head).join(","))?;
        rows.iter().try_for_each(|row| writeln!(file, "{}", COLUMNS.map(|(_, cell)| cell(row)).join(",")))
    })?;
    Ok(())
}

/// The rows as aligned text with the columns that matter most to people.
#[must_use]
pub fn text(rows: &[Row]) -> String {
    let heads = TEXT_COLUMNS.map(|(head, _)| String::from(head));
    let cells = rows.iter().map(|row| TEXT_COLUMNS.map(|(_, cell)| cell(row)));
    let lines: Vec<_> = iter::once(heads).chain(cells).collect();
    let mut widths = [0; TEXT_COLUMNS.len()];
    for line in &lines {
        for (width, cell) in widths.iter_mut().zip(line) {
            *width = cell.len().max(*width);
        }
    }
    let mut text = String::new();
    for line in &lines {
        for (column, (cell, width)) in line.iter().zip(widths).enumerate() {
            // Words to the left, figures to the right.
            text += &match column {
                0 | 1 => format!("{cell:<width$}  "),
                last if last + 1 == TEXT_COLUMNS.len() => format!("{cell}\n"),
                _ => format!("{cell:>width$}  "),
            };
        }
    }
    text
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::method::Method;
    use crate::run::{End, Figures};

    fn rows() -> [Row; 2] {
        let errors = Errors { means: vec![1.0, 2.0], sd: 0.5, max: 4.0 };
        let figures = Figures { errors, clip_share: 0.25, us_per_step: 150.0 };
        let row = Row { method: Method::TledLargeStep, ..Row::example(End::Reached(figures)) };
        [row.clone(), Row { end: End::Diverged(0.0126), ..row }]
    }

    #[test]
    fn a_file_has_the_figures_and_leaves_unknown_ones_empty() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("results.csv");
        write_csv(&path, &rows()).unwrap();
        let text = std::fs::read_to_string(path).unwrap();
        let lines: Vec<&str> = text.lines().collect();
        assert_eq!(lines[0], COLUMNS.map(|(head, _)| head).join(","));
        let known = "lobe,tled-large-step,10,2.000000,0.500000,4.000000,1.500000,3.000000,0.500000,0.250000,\
                     150.000,500000.000,1.500000,2.000000,limited,3.500000";
        assert_eq!(lines[1], known);
        let unknown = "lobe,tled-large-step,10,,,,,3.000000,,,,,1.500000,2.000000,diverged at 0.013 s,3.500000";
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
