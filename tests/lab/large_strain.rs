//! Elements at large strain, on the coarsest meshes.

use supple::material::Element;
use supple_lab::large_strain::{Case, End, Law, Plan, evaluate};

#[test]
fn a_table_of_large_strain_has_a_row_for_each_element_and_counts_who_is_near() {
    let plan = Plan::quick();
    let mut found = evaluate(&plan, |_| {}).unwrap();
    println!("{}", found.text());
    assert_eq!((found.truths.len(), found.rows.len()), (12, 36));
    let soft = |case, element, share| {
        let is = |row: &&supple_lab::large_strain::Row| {
            let truth = &found.truths[row.truth];
            (truth.case, truth.law, truth.share, row.element) == (case, Law::NeoHookean, share, element)
        };
        found.rows.iter().find(is).unwrap()
    };
    for case in Case::ALL {
        for share in [0.2, 0.4] {
            let rows = Element::ALL.map(|element| soft(case, element, share));
            let [linear, pressure, strain] = rows.map(|row| row.force_error);
            assert!(linear > pressure && pressure > strain && strain > 0.0, "{} {share}", case.name());
            assert!(rows.iter().all(|row| row.end == End::Rest && row.is_sound() && row.distance_share < 50.0));
        }
    }
    // With all truths counted; the forces of 20 and 40 % of shear are 0.25 and 0.5 N on 12 cells.
    found.truths.iter_mut().for_each(|truth| truth.fails = None);
    let counts = found.counts(None);
    assert!(counts.iter().all(|count| count.rows == 12 && count.unsound == 0 && count.within[0] <= count.within[1]));
    assert!(counts.iter().map(|count| count.nearest[0]).sum::<usize>() >= 12 && counts[2].nearest[0] > 6);
    let of_shear = found.truths.iter().find(|truth| truth.case == Case::Shear && truth.share == 0.2).unwrap();
    assert!((of_shear.force * (1.0 + 0.01 * of_shear.meshes[0]) - 0.249).abs() < 0.001);

    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("large-strain.csv");
    found.write_csv(&path).unwrap();
    let csv = std::fs::read_to_string(path).unwrap();
    let columns: Vec<usize> = csv.lines().map(|line| line.split(',').count()).collect();
    assert!(columns.len() == 37 && columns.iter().all(|count| *count == columns[0]), "{columns:?}");
}
