//! Hostile input: files that are damaged on purpose, and calls as no sound host makes them. Nothing panics, hangs or
//! takes more memory than a multiple of the input; what is refused says why and changes nothing; what is called good is
//! finite. How long runs are made: `docs/architecture.md`. Recipes are tried with the training (`recipes.rs`), the
//! command's own files in `src/bin/supple/hostile.rs`, the C API in `tests/capi/hostile.c`.

#[path = "../support/hostile.rs"]
mod hostile;
#[path = "../support/networks.rs"]
mod networks;
#[path = "../reference/mod.rs"]
mod reference;
#[path = "../support/mod.rs"]
mod support;

mod meshes;
mod steps;
mod weights;

#[global_allocator]
static ALLOCATOR: hostile::Counting = hostile::Counting;

/// Files of `tests/data` whose names end like this.
fn data(ends: &[&str]) -> Vec<Vec<u8>> {
    let folder = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/data");
    let mut paths: Vec<_> = std::fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().path()).collect();
    paths.sort();
    paths.retain(|path| ends.iter().any(|end| path.to_str().is_some_and(|name| name.ends_with(end))));
    paths.iter().map(|path| std::fs::read(path).unwrap()).collect()
}

#[test]
fn the_allocator_counts_what_is_held_at_the_same_time() {
    let (_, bytes) = hostile::measured(|| {
        drop(std::hint::black_box(vec![0u8; 1000]));
        std::hint::black_box(vec![1u8; 3000])
    });
    assert_eq!(bytes, 3000);
}
