//! Damaged recipes for training: a recipe is refused with a reason, or its numbers are in their ranges.

use supple::train::recipe::{MotionRecipe, Recipe};

use crate::hostile::{Changes, Run, measured};

/// Bytes of memory for a byte of a recipe, and for any recipe.
const BYTES: u64 = 200;
const ANY: u64 = 20_000;

#[test]
fn recipes() {
    let folder = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("../../weights");
    let read = |name| std::fs::read(folder.join(name)).unwrap();
    let sound = ["compact-10.toml", "paper-10.toml"].map(read);
    let words: &[&[u8]] = &[
        b"[noise]\n",
        b"copies = 1\n",
        b"[[a]]\n",
        b"[[motion]]\n",
        b"\"\"\"",
        b"[",
        b"{a=",
        b"element = \"nodal-strain\"\n",
        b"a.b = 1\n",
    ];
    let changes = Changes { sound: &sound, words, most: 50_000 };
    Run::new("recipes", 4_000).each(|dice| {
        let bytes = changes.input(dice);
        let text = String::from_utf8_lossy(&bytes);
        let (recipe, memory) = measured(|| Recipe::parse(&text));
        assert!(memory <= BYTES * bytes.len() as u64 + ANY, "{memory} bytes for {}", bytes.len());
        if let Err(error) = &recipe {
            assert!(error.to_string().len() > 4, "{error:?}");
        }
        if let Ok(recipe) = &recipe {
            let usable = |motion: &MotionRecipe| motion.frames > 0 && motion.to.is_finite();
            assert!(!recipe.motion.is_empty() && recipe.motion.iter().all(usable) && recipe.training.rate.is_finite());
        }
        recipe.is_ok()
    });
}
