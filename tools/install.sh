#!/usr/bin/env bash
# Builds the C library, shared and static, and installs it with its header, a pkg-config file and a CMake package, for
# Linux. The installed folder may be moved as a whole. Takes some minutes.
#
#     tools/install.sh --prefix DIR [--destdir DIR] [--features FEATURES]
#
# --destdir is put before the prefix, to make packages. FEATURES (capi) are those of Cargo.toml: capi-neo-hookean leaves
# out the exponential law; deterministic may be added after a comma.
set -euo pipefail

usage() {
    echo "usage: tools/install.sh --prefix DIR [--destdir DIR] [--features FEATURES]" >&2
    exit 2
}

prefix='' destdir='' features=capi
while [ $# -gt 0 ]; do
    [ $# -ge 2 ] || usage
    case $1 in
        --prefix) prefix=$2 ;;
        --destdir) destdir=$2 ;;
        --features) features=$2 ;;
        *) usage ;;
    esac
    shift 2
done
[ -n "$prefix" ] || usage
to=$(realpath -m "$destdir$prefix")
cd "$(dirname "$0")/.."

# Before 1.0 every minor version may change the functions: it has a shared library of its own.
version=$(sed -n 's/^version = "\(.*\)"/\1/p' Cargo.toml | head -1)
case $version in
    0.*) compatible=${version%.*} ;;
    *) compatible=${version%%.*} ;;
esac
shared=libsupple.so.$version
soname=libsupple.so.$compatible

cargo rustc --quiet --release --lib --no-default-features --features "$features,panic-handler" \
    --crate-type staticlib,cdylib -- -C "link-arg=-Wl,-soname,$soname"
built=${CARGO_TARGET_DIR:-target}/release

fill() {
    sed -e "s/@version@/$version/" -e "s/@compatible@/$compatible/" "tools/package/$1.in" >"$to/$2/$1"
    chmod 644 "$to/$2/$1"
}

install -d "$to/include" "$to/lib/pkgconfig" "$to/lib/cmake/supple"
install -m 644 include/supple.h* "$to/include"
install -m 644 "$built/libsupple.a" "$to/lib"
# Rust's own fmod, sqrt and the like would take the place of the host's, and ask for a function that only Rust programs
# have. The core needs none of them.
ar t "$to/lib/libsupple.a" | grep -v '^supple\.' | sort -u | xargs ar d "$to/lib/libsupple.a"
strip --strip-debug "$to/lib/libsupple.a"
install -m 755 "$built/libsupple.so" "$to/lib/$shared"
ln -sf "$shared" "$to/lib/$soname"
ln -sf "$soname" "$to/lib/libsupple.so"
fill supple.pc lib/pkgconfig
fill supple-config.cmake lib/cmake/supple
fill supple-config-version.cmake lib/cmake/supple
# The loader knows what is in its own folders from a cache.
case $destdir$prefix in
    /usr | /usr/local) ldconfig || echo "run ldconfig, for programs to find $soname" >&2 ;;
esac
