//! What was found, for people and programs.

use std::fmt::Write;
use std::path::Path;

use supple::io::write_atomically;
use supple::material::Element;

use super::{AGREED, End, FOLDED, Found, Row};
use crate::LabError;

/// What each element came to at a share.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Count {
    /// Rows with a truth.
    pub rows: usize,
    /// Nearest of the elements in force, and in displacement.
    pub nearest: [usize; 2],
    /// Within 5 and 10 % of the force.
    pub within: [usize; 2],
    /// Not at rest, refused, or inside out.
    pub unsound: usize,
}

impl Found {
    /// Of each element, over the truths of a share, or over all; a row that is not sound is neither near nor right.
    #[must_use]
    pub fn counts(&self, share: Option<f64>) -> [Count; 3] {
        let mut counts = [Count::default(); 3];
        let is_asked = |row: &Row| {
            let truth = &self.truths[row.truth];
            truth.fails.is_none() && share.is_none_or(|share| share == truth.share)
        };
        for row in self.rows.iter().filter(|row| is_asked(row)) {
            let Some(count) = Element::ALL.iter().position(|element| *element == row.element).map(|at| &mut counts[at])
            else {
                continue;
            };
            let is_rival = |other: &&Row| (other.truth, other.across) == (row.truth, row.across) && other.is_sound();
            let is_nearest = |error: fn(&Row) -> f64| {
                row.is_sound() && self.rows.iter().filter(is_rival).all(|rival| error(row) <= error(rival))
            };
            count.rows += 1;
            count.nearest[0] += usize::from(is_nearest(|row| row.force_error.abs()));
            count.nearest[1] += usize::from(is_nearest(|row| row.distance));
            for (within, limit) in count.within.iter_mut().zip([5.0, 10.0]) {
                *within += usize::from(row.is_sound() && row.force_error.abs() <= limit);
            }
            count.unsound += usize::from(!row.is_sound());
        }
        counts
    }

    /// The table and the count.
    #[must_use]
    pub fn text(&self) -> String {
        let mut text = String::from(
            "case         tissue       share   truth N  meshes %       fold mm  least J  across  linear: force %  shape %  least J   \
             nodal-pressure: the same        nodal-strain: the same\n",
        );
        for (at, truth) in self.truths.iter().enumerate() {
            let mut across: Vec<u32> = self.rows.iter().filter(|row| row.truth == at).map(|row| row.across).collect();
            across.sort_unstable();
            across.dedup();
            for across in across {
                let (case, law, share) = (truth.case.name(), truth.law.name(), 100.0 * truth.share);
                let _ = write!(
                    text,
                    "{case:12} {law:12} {share:3.0} % {:9.4} {:+8.1} {:+6.1} {:8.2} {:8.3} {across:7}",
                    truth.force,
                    truth.meshes[0],
                    truth.meshes[1],
                    1e3 * truth.fold,
                    truth.least
                );
                for row in self.rows.iter().filter(|row| (row.truth, row.across) == (at, across)) {
                    let figures = format!("{:+7.1} {:6.1} {:6.2}", row.force_error, row.distance_share, row.least);
                    let _ = write!(text, "   {figures:22}{:8}", end(row));
                }
                let _ =
                    writeln!(text, "  {}", truth.fails.map_or_else(String::new, |why| format!("not counted: {why}")));
            }
        }
        let mut shares: Vec<f64> = self.truths.iter().map(|truth| truth.share).collect();
        shares.sort_by(f64::total_cmp);
        shares.dedup();
        let _ = writeln!(
            text,
            "\nforce and shape: error over the truth and rms distance over the way of the supports; truths are \
             not counted whose fine meshes differ by more than {AGREED} % in force, or whose surface passes into what moves it \
             by more than {} mm\n\nshare  element         rows  nearest in force  in shape  \
             within 5 %  10 %  unsound",
            1e3 * FOLDED
        );
        for share in shares.into_iter().map(Some).chain([None]) {
            let name = share.map_or_else(|| "all".into(), |share| format!("{:.0} %", 100.0 * share));
            for (element, count) in Element::ALL.into_iter().zip(self.counts(share)) {
                let Count { rows, nearest: [force, shape], within: [five, ten], unsound } = count;
                let element = element.name();
                let _ = writeln!(
                    text,
                    "{name:>5}  {element:15} {rows:4}  {force:16}  {shape:8}  {five:10}  {ten:4}  {unsound:7}"
                );
            }
        }
        text
    }

    /// Writes the rows as comma-separated values.
    pub fn write_csv(&self, path: &Path) -> Result<(), LabError> {
        write_atomically(path, |file| {
            writeln!(
                file,
                "case,law,share,across,element,force_n,true_force_n,force_error_percent,distance_mm,distance_percent,\
                 least_volume_ratio,end,finer_mesh_percent,less_fine_mesh_percent,true_fold_mm,true_least_volume_ratio,truth_fails"
            )?;
            self.rows.iter().try_for_each(|row| {
                let truth = &self.truths[row.truth];
                writeln!(
                    file,
                    "{},{},{},{},{},{},{},{:.3},{:.5},{:.3},{:.4},{},{:.3},{:.3},{:.3},{:.4},{}",
                    truth.case.name(),
                    truth.law.name(),
                    truth.share,
                    row.across,
                    row.element.name(),
                    row.force,
                    truth.force,
                    row.force_error,
                    row.distance,
                    row.distance_share,
                    row.least,
                    end(row),
                    truth.meshes[0],
                    truth.meshes[1],
                    1e3 * truth.fold,
                    truth.least,
                    truth.fails.unwrap_or_default()
                )
            })
        })?;
        Ok(())
    }
}

/// How a row ended, in a word.
const fn end(row: &Row) -> &'static str {
    match row.end {
        End::Rest if row.least <= 0.0 => "turned",
        End::Rest => "",
        End::Limited => "limited",
        End::Restless => "restless",
        End::Refused(_) => "refused",
    }
}
