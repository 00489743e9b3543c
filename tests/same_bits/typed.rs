//! A program that knows its law and its tetrahedra when it is compiled moves its scene as one that chooses them at run
//! time does.

use supple::material::{Element, VecMaterial};

use crate::body::TISSUE;
use crate::level_guard;
use crate::sums::{Level, NAMES, checksum, checksum_of};

#[test]
fn a_material_chosen_at_run_time_gives_the_same_bits() {
    let _guard = level_guard();
    for (name, element) in [("nodal-pressure", Element::NodalPressure), ("nodal-strain", Element::NodalStrain)] {
        let what = NAMES.iter().position(|&kept| kept == name).unwrap();
        for level in Level::available() {
            let typed = checksum(what, level);
            let chosen = checksum_of(VecMaterial::one(element, TISSUE.law, TISSUE.density));
            println!("{name} ({level:?}): {typed:08x}");
            assert!(typed != 0 && chosen == Some(typed), "{name}, {level:?}: {chosen:08x?}");
        }
    }
}
