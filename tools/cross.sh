#!/usr/bin/env bash
# The same bits on other processors, without having one: builds tests/targets for 64-bit Arm, for WebAssembly and for a
# microcontroller (Cortex-M4F), runs it in emulators and in node, and compares the checksums with those of
# tests/targets/checksums.txt, to which the test `targets` holds this processor.
#
#     tools/cross.sh [--install | --version]
#
# The tests of the registers run on the emulated Arm processor as well. A compiler with those targets comes from Debian 12's packages
# into the user's cache folder, with links from target/cross (--install does only that): about 260 MB to fetch and 1.5 GB in all.
# Nothing is installed into the system, except node and QEMU where there is none. --version tells the compiler's.
set -euo pipefail
cd "$(dirname "$0")/.."

folder=$PWD/target/cross
mkdir -p "$folder"

step() { printf '\n== %s\n' "$*"; "$@"; }

# The compiler (Debian's, whose targets rustup's lacks when it cannot be asked), Arm's C library and linker, the emulator.
packages=(
    rustc-web rust-web-src libstd-rust-web-1.96 libstd-rust-web-dev libllvm22
    libstd-rust-web-dev:arm64
    gcc-12-aarch64-linux-gnu gcc-aarch64-linux-gnu cpp-12-aarch64-linux-gnu binutils-aarch64-linux-gnu libgcc-12-dev-arm64-cross
    libgcc-s1-arm64-cross libc6-arm64-cross libc6-dev-arm64-cross linux-libc-dev-arm64-cross
    qemu-user-static
)

# One folder for each list of packages, which appears as a whole or not at all.
compilers=${XDG_CACHE_HOME:-~/.cache}/supple-ci/cross
compiler=$compilers/$(sha256sum <<<"${packages[*]}" | cut -c 1-16)
root=$compiler/root

install() {
    local new=$compilers/new
    find "$compilers" -mindepth 1 -maxdepth 1 -type d -mtime +30 -exec rm -r {} +
    rm -rf "$new"
    mkdir "$new"
    # A state of apt's own: the system's knows no packages for Arm, and shall not.
    local apt=$new/apt
    mkdir -p "$apt"/state/lists/partial "$apt"/cache/archives/partial "$new/debs" "$new/root"
    touch "$apt/state/status"
    local options=(
        -qq -o APT::Architecture=amd64 -o APT::Architectures::=amd64 -o APT::Architectures::=arm64
        -o "Dir::State=$apt/state" -o "Dir::State::status=$apt/state/status" -o "Dir::Cache=$apt/cache"
        -o APT::Sandbox::User=root
    )
    apt-get "${options[@]}" update
    (cd "$new/debs" && apt-get "${options[@]}" download "${packages[@]}")
    for package in "$new"/debs/*.deb; do
        dpkg -x "$package" "$new/root"
    done
    rm -r "$new/debs" "$apt"
    printf '#!/bin/sh\nLD_LIBRARY_PATH=%s exec %s "$@"\n' "$root/usr/lib/x86_64-linux-gnu:$root/usr/lib" \
        "$root/usr/bin/rustc" >"$new/rustc"
    # cargo with it, which builds the parts of the standard library that it has only as source.
    printf '#!/bin/sh\nRUSTC=%s RUSTC_BOOTSTRAP=1 LD_LIBRARY_PATH=%s exec cargo "$@"\n' "$compiler/rustc" \
        "$root/usr/lib/x86_64-linux-gnu" >"$new/cargo"
    chmod +x "$new/rustc" "$new/cargo"
    sync -f "$new"
    mv -T "$new" "$compiler"
}
version() { "$compiler/rustc" --version 2>/dev/null; }

if [ "${1:-}" = --version ]; then
    version || echo "no compiler for other processors"
    exit
fi

missing=()
command -v node >/dev/null || missing+=(nodejs)
command -v qemu-system-arm >/dev/null || missing+=(qemu-system-arm)
if [ ${#missing[@]} -gt 0 ]; then
    apt-get update -qq && apt-get install -y -qq --no-install-recommends "${missing[@]}"
fi
mkdir -p "$compilers"
exec 8>"$compilers/lock"
flock 8
version >/dev/null || step install
flock -u 8
ln -sfn "$root" "$compiler/rustc" "$compiler/cargo" "$folder"
[ "${1:-}" != --install ] || exit 0

# rustup's compiler brings a linker for WebAssembly and microcontrollers.
lld=$(rustc --print sysroot)/lib/rustlib/x86_64-unknown-linux-gnu/bin/rust-lld
export CARGO_TARGET_WASM32_UNKNOWN_UNKNOWN_LINKER=$lld
export CARGO_TARGET_WASM32_UNKNOWN_UNKNOWN_RUSTFLAGS="-C target-feature=+simd128"
export CARGO_TARGET_THUMBV7EM_NONE_EABIHF_LINKER=$lld
export CARGO_TARGET_THUMBV7EM_NONE_EABIHF_RUSTFLAGS="-C link-arg=-Tlink.x"
arm=$root/usr/bin/aarch64-linux-gnu
export CC_aarch64_unknown_linux_gnu=$arm-gcc AR_aarch64_unknown_linux_gnu=$arm-ar
export CFLAGS_aarch64_unknown_linux_gnu=--sysroot=$root
export CARGO_TARGET_AARCH64_UNKNOWN_LINUX_GNU_LINKER=$arm-gcc
export CARGO_TARGET_AARCH64_UNKNOWN_LINUX_GNU_RUSTFLAGS="-C link-arg=--sysroot=$root"
emulator=$root/usr/bin/qemu-aarch64-static
export CARGO_TARGET_AARCH64_UNKNOWN_LINUX_GNU_RUNNER="$emulator -L $root/usr/aarch64-linux-gnu"

here=$folder/build
targets=(--quiet --release --manifest-path tests/targets/Cargo.toml --target-dir "$here")
step "$folder/cargo" build "${targets[@]}" --target aarch64-unknown-linux-gnu
step "$folder/cargo" rustc "${targets[@]}" --target wasm32-unknown-unknown -Zbuild-std=core --lib --crate-type cdylib \
    --features panic-handler
step "$folder/cargo" build --quiet --release --manifest-path tests/targets/m4/Cargo.toml --target-dir "$here" \
    --target thumbv7em-none-eabihf -Zbuild-std=core

# compare WHICH COMMAND: says what a processor computes, and that it is what is kept, and all of it that matches WHICH.
compare() {
    local which=$1
    shift
    "$@" | tee "$folder/checksums"
    if grep -vxFf tests/targets/checksums.txt "$folder/checksums"; then
        echo "not the bits of tests/targets/checksums.txt: the above" >&2
        return 1
    fi
    sort -u "$folder/checksums" | grep "$which" | diff - <(grep "$which" tests/targets/checksums.txt | sort)
}
# shellcheck disable=SC2086 # A command with its arguments.
step compare fused $CARGO_TARGET_AARCH64_UNKNOWN_LINUX_GNU_RUNNER "$here/aarch64-unknown-linux-gnu/release/targets"
step compare " unfused " node tests/targets/run.mjs "$here/wasm32-unknown-unknown/release/targets.wasm"
# A nanosecond for each instruction, by which it counts its own. A fault would be a loop without end there.
step compare " unfused " timeout 10m qemu-system-arm -machine mps2-an386 -cpu cortex-m4 -icount shift=0 -nographic \
    -semihosting-config enable=on,target=native -kernel "$here/thumbv7em-none-eabihf/release/m4"
echo "the same bits as on other processors with the same rounding"

step "$folder/cargo" test "${targets[@]}" --target aarch64-unknown-linux-gnu --test simd
