#!/usr/bin/env bash
# Builds the source distribution and the wheel of the Python package with its own build (src/python/setup.py), and tests both from clean
# virtual environments.
#
#     tools/wheel.sh [--target aarch64] [LIBRARY]
#
# LIBRARY: a libsupple.so with the features io and parallel that is there already; else one is compiled. Wheel and source distribution
# are in target/wheel. The library chooses its instructions itself and needs no more than glibc, of the version that the name of the wheel
# tells (that of the machine that built it, at most 2.34); nothing in the wheel is compiled for a Python: one wheel for every Python 3 on
# such a Linux.
#
# --target aarch64: a wheel for 64-bit Arm, compiled by the compiler of tools/cross.sh. Of it the library alone is tested, which moves the
# bar of examples/bar.c in an emulator; no Python of that processor is there.
set -euo pipefail
cd "$(dirname "$0")/.."

target=
if [ "${1:-}" = --target ]; then
    target=${2:-}
    [ "$target" = aarch64 ] || { sed -n '5s/^# *//p' "$0" >&2; exit 2; }
    shift 2
fi
folder=$PWD/target/wheel${target:+-$target}
[ -z "${1:-}" ] || SUPPLE_LIBRARY=$(realpath "$1")
[ -z "${SUPPLE_LIBRARY:-}" ] || export SUPPLE_LIBRARY
rm -rf "$folder"
mkdir -p "$folder"
python3 -c 'import ensurepip' 2>/dev/null || {
    apt-get update -qq && apt-get install -y -qq --no-install-recommends python3-venv
}
python3 -m venv "$folder/build"
"$folder/build/bin/pip" install --quiet build==1.6.1

if [ -n "$target" ]; then
    tools/cross.sh --install
    root=$(realpath target/cross/root)
    export CARGO=$PWD/target/cross/cargo CARGO_BUILD_TARGET=aarch64-unknown-linux-gnu
    export CARGO_TARGET_AARCH64_UNKNOWN_LINUX_GNU_LINKER=$root/usr/bin/aarch64-linux-gnu-gcc
    export CARGO_TARGET_AARCH64_UNKNOWN_LINUX_GNU_RUSTFLAGS="-C link-arg=--sysroot=$root"
    export CARGO_TARGET_DIR=$PWD/target/cross/build
    "$folder/build/bin/python" -m build --wheel --outdir "$folder" src/python >"$folder/build.log" || { tail -40 "$folder/build.log" >&2; exit 1; }
    ls -l "$folder"/supple-*-py3-none-manylinux_*_aarch64.whl
    "$folder/build/bin/python" -m zipfile -e "$folder"/supple-*.whl "$folder/unpacked"
    LD_LIBRARY_PATH=$root/usr/lib/x86_64-linux-gnu "$root/usr/bin/aarch64-linux-gnu-gcc" "--sysroot=$root" -std=c11 -O2 -Iinclude examples/bar.c "$folder/unpacked/supple/libsupple.so" \
        "-Wl,-rpath,$folder/unpacked/supple" -lm -o "$folder/bar"
    "$root/usr/bin/qemu-aarch64-static" -L "$root/usr/aarch64-linux-gnu" "$folder/bar" | tee "$folder/said"
    # As in tests of the C library on this processor.
    grep -q '^the tip moved by 0.0069' "$folder/said"
    exit
fi

# The wheel out of the source distribution: what is not in that is missed here.
"$folder/build/bin/python" -m build --outdir "$folder" src/python >"$folder/build.log" || { tail -40 "$folder/build.log" >&2; exit 1; }
wheel=$(ls "$folder"/supple-*-py3-none-manylinux_*.whl)
ls -l "$folder"/supple-*.tar.gz "$wheel"

# With its extras from a folder, as where there is no index, and its own sources as mypy sees them.
"$folder/build/bin/pip" download --quiet --dest "$folder/index" "$wheel[mesh,image,fit]"
python3 -m venv "$folder/bare"
"$folder/bare/bin/pip" install --quiet --no-index --find-links "$folder/index" 'supple[mesh,image,fit]'
"$folder/bare/bin/pip" check
(cd "$folder" && time bare/bin/python -m supple demo --out "$folder/demo.svg")

python3 -m venv "$folder/clean"
"$folder/clean/bin/pip" install --quiet "$wheel" -r tests/python/requirements.txt mypy==2.4.1
cd "$folder" # not where the sources are
clean/bin/mypy --strict --no-error-summary --cache-dir mypy --config-file "$OLDPWD/src/python/pyproject.toml" -p supple
clean/bin/python -m pytest --quiet -p no:cacheprovider "$OLDPWD/tests/python"
