#!/usr/bin/env bash
# Tests the C library as others get it: installs it, moves the installed folder, looks at what is in it, builds and runs the
# installed examples with one compiler or both through pkg-config and CMake, shared and static. A line for each check.
#
#     tools/packages.sh [gcc] [clang]
#
# Leaves the installed library in target/packages/installed.
set -euo pipefail
cd "$(dirname "$0")/.."

[ $# -gt 0 ] || set -- gcc clang
missing=()
need() { command -v "$1" >/dev/null || missing+=("$2"); }
need g++ g++
[[ " $* " != *" clang "* ]] || need clang++ clang
need readelf binutils
need make make
need cmake cmake
need pkg-config pkg-config
need valgrind valgrind
if [ ${#missing[@]} -gt 0 ]; then
    apt-get update -qq && apt-get install -y -qq --no-install-recommends "${missing[@]}"
fi

folder=$(realpath -m target/packages)
prefix=$folder/installed
rm -rf "$folder"
mkdir -p "$folder"

ok() { echo "ok: $*"; }
fail() {
    echo "failed: $*" >&2
    exit 1
}

tools/header.sh --verify || fail "include/supple.h is not what tools/header.sh makes"
ok "the header is that of src/capi"

# Whatever is checked is checked where nothing was installed to.
tools/install.sh --prefix "$folder/before" | tee "$folder/told"
mv "$folder/before" "$prefix"
if grep -rl -e "$folder/before" -e "$PWD" "$prefix"; then
    fail "the above name folders of the build"
fi
ok "no file names the folder that it was installed to, nor that of the sources"

# What the installer tells is there, and what else a host needs is what it is here.
while read -r where files; do
    for file in $files; do
        [ -e "$prefix${where#"$folder/before"}/$file" ] || fail "the installer tells of $where/$file, which is not there"
    done
done <"$folder/told"
share=$prefix/share/supple
for kind in weights/*.weights examples/*.* meshes/*.msh; do
    cmp "$kind" "$share/$kind" || fail "$kind is not installed"
done
for licence in LICENSE-*; do
    cmp "$licence" "$share/licences/$licence" || fail "$licence is not installed"
done
python3 "$share/tools/mesh_to_c.py" "$share/meshes/lobe.msh" "$folder/lobe_mesh.h"
ok "weights, examples, meshes and licences are those of the sources, and all that the installer tells of is there"

version=$(sed -n 's/^version = "\(.*\)"/\1/p' Cargo.toml | head -1)
shared=$prefix/lib/libsupple.so
static=$prefix/lib/libsupple.a

# What the header declares, and nothing else.
gcc -E -P include/supple.h | grep -o '\bsupple_[a-z_]*(' | tr -d '(' | sort -u >"$folder/declared"
nm -D --defined-only "$shared" | awk '{ print $3 }' | sort >"$folder/exported"
diff "$folder/declared" "$folder/exported" || fail "the shared library exports (>) what the header does not declare (<)"
ok "the shared library exports the $(wc -l <"$folder/declared") functions of the header and nothing else"
nm -g --defined-only "$static" | awk 'NF == 3 { print $3 }' | sort >"$folder/exported"
diff "$folder/declared" "$folder/exported" || fail "the static library defines (>) what the header does not declare (<)"
ok "the static library defines the same functions and nothing else"

dynamic=$(readelf -dW "$shared")
! grep NEEDED <<<"$dynamic" || fail "the shared library needs others"
undefined() { nm "$@" | awk '$1 == "U" { print $2 }' | sort | xargs; }
for asks in "$(undefined -D "$shared")" "$(undefined "$static")"; do
    [ "$asks" = "memcpy memset" ] || fail "a library asks its host for: $asks"
done
ok "they need no other library, and of the host memcpy and memset"
soname=$(sed -n 's/.*soname: \[\(.*\)\]/\1/p' <<<"$dynamic")
case $version in
    0.*) [ "$soname" = "libsupple.so.${version%.*}" ] ;;
    *) [ "$soname" = "libsupple.so.${version%%.*}" ] ;;
esac || fail "version $version is called $soname"
[ "$(realpath "$prefix/lib/$soname")" = "$prefix/lib/libsupple.so.$version" ] || fail "$soname does not lead to the library"
ok "version $version is called $soname"

# Paths to a panic: in the shared library, and in a program that keeps every function of the static one.
! nm "$shared" | grep -i panicking || fail "the shared library can panic"
mapfile -t keep < <(sed 's/^/-Wl,-u,/' "$folder/declared")
echo 'int main(void) { return 0; }' >"$folder/empty.c"
gcc "$folder/empty.c" -Wl,--gc-sections "${keep[@]}" "$static" -o "$folder/everything"
[ "$(nm "$folder/everything" | grep -c ' T supple_')" = "$(wc -l <"$folder/declared")" ] || fail "the program lacks functions"
! nm "$folder/everything" | grep -i panicking || fail "the static library can panic"
ok "no path to a panic, in the shared library nor in a program with all of the static one"

sources=("$share/examples/bar.c" "$share/examples/instrument.cpp" "$PWD/tests/packages/included.cpp")

# run PROGRAM NAME: all programs of a name must say the same, apart from times. Their meshes and weights are the installed ones.
run() {
    if [ "$2" = instrument ]; then
        (cd "$share" && "$1" --frames 3) | awk '/^worst/ { next } /^ *[0-9]+\./ { $2 = $3 = "" } { print }'
    else
        "$1"
    fi >"$folder/said" || fail "$1 failed"
    [ -s "$folder/said" ] || fail "$1 says nothing"
    [ -e "$folder/$2.said" ] || cp "$folder/said" "$folder/$2.said"
    diff "$folder/$2.said" "$folder/said" || fail "$1 does not say what the others say"
}

export PKG_CONFIG_PATH=$prefix/lib/pkgconfig
[ "$(pkg-config --modversion supple)" = "$version" ] || fail "pkg-config knows another version"
warnings=(-O2 -Wall -Wextra -Werror -pedantic)
read -ra cflags < <(pkg-config --cflags supple)
read -ra libs < <(pkg-config --libs supple)
read -ra all_libs < <(pkg-config --static --libs supple)

# build COMPILER... SOURCE, in three ways.
build() {
    local source=${*: -1} compiler=("${@:1:$#-1}")
    local name
    name=$(basename "${source%.*}")
    local program=$folder/$1-$name
    "${compiler[@]}" "${warnings[@]}" "${cflags[@]}" "$source" "${libs[@]}" -o "$program-shared"
    LD_LIBRARY_PATH=$prefix/lib run "$program-shared" "$name"
    "${compiler[@]}" "${warnings[@]}" "${cflags[@]}" "$source" "$static" -o "$program-static"
    "${compiler[@]}" "${warnings[@]}" "${cflags[@]}" "$source" -static "${all_libs[@]}" -o "$program-alone"
    for linked in static alone; do
        ! readelf -dW "$program-$linked" | grep 'NEEDED.*supple' || fail "$program-$linked needs the shared library"
        run "$program-$linked" "$name"
    done
    ok "$name, $1 through pkg-config, shared, static, and all static: $(head -1 "$folder/said")"
}
declare -A plus=([gcc]=g++ [clang]=clang++)
for source in "${sources[@]}"; do
    for compiler in "$@"; do
        case $source in
            *.c) build "$compiler" -std=c11 "$source" ;;
            *) build "${plus[$compiler]}" -std=c++17 "$source" ;;
        esac
    done
done

for compiler in "$@"; do
    compilers=$compiler,${plus[$compiler]}
    cmake -S tests/packages -B "$folder/cmake-$compilers" -DCMAKE_PREFIX_PATH="$prefix" -Dversion="$version" \
        -Dsources="$(IFS=';' && echo "${sources[*]}")" \
        -DCMAKE_C_COMPILER="${compilers%,*}" -DCMAKE_CXX_COMPILER="${compilers#*,}" -DCMAKE_BUILD_TYPE=Release \
        -DCMAKE_C_FLAGS="${warnings[*]}" -DCMAKE_CXX_FLAGS="${warnings[*]}" >"$folder/cmake.log" || fail "$(<"$folder/cmake.log")"
    cmake --build "$folder/cmake-$compilers" >"$folder/cmake.log" || fail "$(<"$folder/cmake.log")"
    for source in "${sources[@]}"; do
        name=$(basename "${source%.*}")
        run "$folder/cmake-$compilers/$name-shared" "$name"
        run "$folder/cmake-$compilers/$name-static" "$name"
        ok "$name, $compilers through CMake, shared and static"
    done
done
for other in 0.0 99; do
    if cmake -S tests/packages -B "$folder/cmake-other" -DCMAKE_PREFIX_PATH="$prefix" -Dversion=$other >/dev/null 2>&1; then
        fail "CMake takes version $version for $other"
    fi
done
ok "CMake refuses other versions"

valgrind --quiet --error-exitcode=1 "$folder/$1-bar-static" >"$folder/said" || fail "valgrind finds errors in bar"
ok "valgrind finds no error in bar"
