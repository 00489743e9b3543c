//! Other constants of the laws in a scene that is built: its tables hold none of them, but for the energy that is
//! nothing but rounding. That takes a pass over the elements, where building takes many.

use super::{BuildError, ROUNDED_STRAIN, Scene, SceneFacts, SceneTables, families_of, terms_of};
use crate::element::ElementTile;
use crate::material::{Law, Material, Moduli};
use crate::simd::TILE;

impl SceneFacts {
    /// Takes note of other constants. Whether the tables are those of the new material as well: they are with the same
    /// kind of element, regions, densities and directions of fibres. Else, and on an error, nothing is changed.
    pub(crate) fn change_constants<M: Material, N: Material>(
        &mut self,
        tiles: &[ElementTile],
        old: &M,
        new: &N,
    ) -> Result<bool, BuildError> {
        let several = [old.laws().has_several_tissues(), new.laws().has_several_tissues()];
        let have = [terms_of(new), families_of(new)];
        if old.element() != new.element() || several[0] != several[1] || have != [self.terms, self.families] {
            return Ok(false);
        }
        if self.families > 0 && old.directions() != new.directions() {
            return Ok(false);
        }
        let mut rounding = 0.0;
        let places = tiles.iter().take(self.tile_count()).flat_map(|tile| (0..TILE).map(move |lane| (tile, lane)));
        for (tile, lane) in places {
            let (element, volume) = (tile.element(lane), tile.volume::<f32>(lane));
            if volume <= 0.0 {
                continue;
            }
            let Some(tissue) = new.tissue(element) else { return Err(BuildError::NoTissue { element }) };
            if let Some((name, value)) = tissue.law.unusable_constant() {
                return Err(BuildError::Constant { element, name, value });
            }
            let is_same = old.tissue(element).is_some_and(|before| before.density == tissue.density);
            if !is_same || old.region(element) != new.region(element) {
                return Ok(false);
            }
            rounding += f64::from(volume) * (0.5 * Moduli::of(&tissue.law).shear * ROUNDED_STRAIN * ROUNDED_STRAIN);
        }
        self.rounding_energy = rounding;
        Ok(true)
    }
}

impl<M: Material, S: SceneTables> Scene<M, S> {
    /// Gives the elements other constants, in a pass over them, as where tissue stiffens while it moves. Call
    /// [`tled::carry_on`](crate::tled::carry_on) afterwards. Whether it was done: a material of another kind of
    /// element, with other regions, densities or directions of fibres needs a scene that is built anew, and changes
    /// nothing here.
    pub fn set_constants(&mut self, material: M) -> Result<bool, BuildError> {
        let Self { material: old, tables, facts } = self;
        let is_done = facts.change_constants(tables.tables().1, old, &material)?;
        if is_done {
            *old = material;
        }
        Ok(is_done)
    }

    /// What it is made of.
    pub const fn material(&self) -> &M {
        &self.material
    }
}
