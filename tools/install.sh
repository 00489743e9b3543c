#!/usr/bin/env bash
# Builds the C library, shared and static, and installs it with all that a host needs, for Linux. Says what goes where. The
# installed folder may be moved as a whole. Takes some minutes.
#
#     tools/install.sh --prefix DIR [--destdir DIR] [--features FEATURES]
#
#     DIR/include                  supple.h, supple.hpp
#     DIR/lib                      libsupple.so, libsupple.a
#     DIR/lib/pkgconfig            supple.pc
#     DIR/lib/cmake/supple         CMake's find_package(supple)
#     DIR/share/supple/weights     trained networks
#     DIR/share/supple/examples    hosts in C, C++ and Python, which are run from DIR/share/supple
#     DIR/share/supple/meshes      their meshes
#     DIR/share/supple/tools       mesh_to_c.py, which puts meshes and networks into C programs
#     DIR/share/supple/licences    MIT and Apache 2.0, to choose from
#
# --destdir is put before the prefix, to make packages. FEATURES (capi) are those of Cargo.toml: capi-neo-hookean has only the
# first of the laws and no nodal strain; deterministic may be added after a comma, and so may io (meshes out of files) and parallel (threads
# of the library's own): with one of these it needs the system's C library, and the static one more of it than a host may have linked.
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

# All of it as one unit, whatever the profile says: what cannot panic is known only then.
export CARGO_PROFILE_RELEASE_LTO=${CARGO_PROFILE_RELEASE_LTO:-fat}
export CARGO_PROFILE_RELEASE_CODEGEN_UNITS=${CARGO_PROFILE_RELEASE_CODEGEN_UNITS:-1}
# What is not marked for it is not inlined where that takes many bytes: a sixteenth of the library, and no loop takes an instruction more.
cargo rustc -p supple --quiet --release --lib --features "$features,panic-handler" \
    --crate-type staticlib,cdylib -- -C "link-arg=-Wl,-soname,$soname" -C llvm-args=-inline-threshold=50
built=${CARGO_TARGET_DIR:-target}/release

# into FOLDER FILE...: says what goes where, and puts it there.
into() {
    install -d "$to/$1"
    install -m 644 -t "$to/$1" "${@:2}"
    printf '%-39s %s\n' "$to/$1" "$(basename -a "${@:2}" | xargs)"
}
made=$(mktemp -d)
trap 'rm -r "$made"' EXIT
for file in supple.pc supple-config.cmake supple-config-version.cmake; do
    sed -e "s/@version@/$version/" -e "s/@compatible@/$compatible/" "tools/package/$file.in" >"$made/$file"
done

into include include/supple.h include/supple.hpp
into lib "$built/libsupple.a" "$built/libsupple.so"
# Rust's own fmod, sqrt and the like would take the place of the host's, and ask for a function that only Rust programs
# have. The core needs none of them.
case ,$features, in
    *,io,* | *,parallel,*) ;;
    *) ar t "$to/lib/libsupple.a" | grep -v '^supple\.' | sort -u | xargs ar d "$to/lib/libsupple.a" ;;
esac
strip --strip-debug "$to/lib/libsupple.a"
mv "$to/lib/libsupple.so" "$to/lib/$shared"
chmod 755 "$to/lib/$shared"
ln -sf "$shared" "$to/lib/$soname"
ln -sf "$soname" "$to/lib/libsupple.so"
into lib/pkgconfig "$made/supple.pc"
into lib/cmake/supple "$made/supple-config.cmake" "$made/supple-config-version.cmake"
into share/supple/weights weights/*.weights
into share/supple/examples examples/*.*
into share/supple/meshes meshes/*.msh
into share/supple/tools tools/mesh_to_c.py
into share/supple/licences LICENSE-*
# The loader knows what is in its own folders from a cache.
case $destdir$prefix in
    /usr | /usr/local) ldconfig || echo "run ldconfig, for programs to find $soname" >&2 ;;
esac
