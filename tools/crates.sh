#!/usr/bin/env bash
# Makes the packages of the crates `supple` and `supple-cli` as crates.io would get them, compiles them as they are in there with the
# oldest Rust that Cargo.toml names (`rust-version`), and documents the library as docs.rs does. Publishes nothing.
#
#     tools/crates.sh
#
# The packages are in target/package (in CARGO_TARGET_DIR where that is set). rustup installs the old compiler. Where there is none to be
# had, as without rustup, the compiler that there is compiles them, and clippy's `incompatible_msrv` (check `lints`) is all that
# holds the code to the old one.
set -euo pipefail
cd "$(dirname "$0")/.."

most=$((10 << 20)) # bytes that crates.io accepts
version=$(sed -n 's/^version = "\(.*\)"/\1/p' Cargo.toml | head -1)
oldest=$(sed -n 's/^rust-version = "\(.*\)"/\1/p' Cargo.toml | head -1)
target=$(realpath -m "${CARGO_TARGET_DIR:-target}")
folder=$target/crates
rm -rf "$folder"
mkdir -p "$folder"

# Cargo tells of each test and benchmark that is left out.
quiet() { "$@" 2> >(grep -vE '^warning: ignoring (test|benchmark)|^ *(Packaging|Updating|Packaged)' >&2); }
quiet cargo publish --dry-run --allow-dirty --no-verify --quiet -p supple -p supple-cli
quiet cargo package --allow-dirty --no-verify --quiet -p supple -p supple-cli
for name in supple supple-cli; do
    package=$target/package/$name-$version.crate
    tar -xzf "$package" -C "$folder"
    bytes=$(stat -c %s "$package")
    printf '%s  %s bytes, %s files\n' "$package" "$bytes" "$(tar -tzf "$package" | wc -l)"
    [ "$bytes" -lt "$most" ] || { echo "crates.io accepts less than $most bytes" >&2; exit 1; }
    for file in README.md LICENSE-MIT LICENSE-APACHE Cargo.lock; do
        [ -s "$folder/$name-$version/$file" ] || { echo "$package: no $file" >&2; exit 1; }
    done
    # Not of the workspace in whose folder it lies.
    printf '\n[workspace]\n' >>"$folder/$name-$version/Cargo.toml"
done

compiler=("+$oldest")
if ! rustup toolchain install "$oldest" --profile minimal --no-self-update >"$folder/rustup.log" 2>&1; then
    tail -3 "$folder/rustup.log" >&2
    echo "not compiled with Rust $oldest, which cannot be had here, but with $(rustc --version)"
    compiler=()
fi
# crate NAME FEATURES: compiles a package with the other one in place of what crates.io has.
crate() {
    (cd "$folder/$1-$version" && cargo "${compiler[@]}" check --quiet --lib --bins --target-dir "$folder/target" --features "$2" "${@:3}")
    echo "ok: $1 ($2) with Rust ${compiler[*]:-$(rustc --version)}"
}
crate supple ''
crate supple std,parallel,io,safetensors,capi
crate supple-cli '' --config "patch.crates-io.supple.path='$folder/supple-$version'"

features=$(sed -n '/^\[package.metadata.docs.rs\]/,/^$/s/^features = \[\(.*\)\]/\1/p' Cargo.toml | tr -d '" ')
(cd "$folder/supple-$version" && RUSTDOCFLAGS='-D warnings' cargo doc --quiet --no-deps --lib --target-dir "$folder/target" --features "$features")
echo "ok: the documentation of supple ($features)"
