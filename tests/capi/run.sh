#!/usr/bin/env bash
# Tests of the C API against the library as it is installed:
#
#     tests/capi/run.sh [PART...]
#
# programs      the programs of this folder, the examples, and the results of C and Python compared with those of the command
# memory        what valgrind and the sanitizers of gcc say of them, and random calls
# openigtlink   a client of another implementation moves an instrument
#
# Without a part all of them. The library and the command are built first, if they are not.
set -euo pipefail
cd "$(dirname "$0")/../.."

folder=$PWD/target/capi
mkdir -p "$folder"
prefix=$folder/installed
tools/install.sh --prefix "$prefix" >"$folder/told"
shared=$prefix/lib/libsupple.so static=$prefix/lib/libsupple.a
warnings=(-O2 -g -Wall -Wextra -Werror -pedantic -I"$prefix/include")
# What the tests count: whoever asks the C library for memory.
wrapped=-Wl,--wrap=malloc,--wrap=calloc,--wrap=realloc,--wrap=aligned_alloc,--wrap=posix_memalign

# A machine without these packages gets its own.
find_python() {
    python=python3
    if ! python3 -c 'import numpy, pyigtl' 2>/dev/null; then
        python3 -m venv "$folder/venv" 2>/dev/null || {
            apt-get update -qq && apt-get install -y -qq --no-install-recommends python3-venv
            python3 -m venv "$folder/venv"
        }
        python=$folder/venv/bin/python3
        "$python" -m pip install --quiet numpy==2.4.6 pyigtl==0.3.4
    fi
}

programs() {
    cargo build --quiet --release
    local test options element
    for test in misuse sizes copies simulation exchange relaxation fibres switching points heap threads stack; do
        options=(-pthread)
        [ $test != heap ] || options=("$wrapped")
        for element in SUPPLE_NODAL_PRESSURE SUPPLE_LINEAR; do
            gcc -std=c11 "${warnings[@]}" "${options[@]}" -DELEMENT=$element tests/capi/$test.c "$static" -o "$folder/$test"
            "$folder/$test"
        done
    done
    for test in sizes copies simulation exchange relaxation fibres switching points heap threads stack strain; do
        options=(-pthread)
        [ $test != heap ] || options=("$wrapped")
        gcc -std=c11 "${warnings[@]}" "${options[@]}" -DELEMENT=SUPPLE_NODAL_STRAIN tests/capi/$test.c "$static" -o "$folder/$test-strain"
        "$folder/$test-strain"
    done

    g++ -std=c++17 "${warnings[@]}" tests/hosts/wrapper.cpp "$static" -o "$folder/wrapper"
    "$folder/wrapper" weights/compact-10.weights
    g++ -std=c++17 "${warnings[@]}" tests/capi/mistakes.cpp "$static" -o "$folder/mistakes"
    "$folder/mistakes"

    # The bar, of which the README has some lines, and what the command makes of the same scene.
    plain() { sed 's,/\*.*\*/,,; s/^ *//; s/ *$//' "$1"; }
    sed -n '/^```c$/,/^```$/p' README.md | sed '/^```/d' >"$folder/readme.c"
    [ -s "$folder/readme.c" ] || { echo "the README shows no C" >&2; exit 1; }
    if plain "$folder/readme.c" | grep -vxFf <(plain examples/bar.c); then
        echo "the README's C has the above lines, examples/bar.c has not" >&2
        exit 1
    fi
    gcc -std=c11 "${warnings[@]}" examples/bar.c "$static" -o "$folder/bar"
    cat >"$folder/bar.toml" <<'SCENE'
damping = 20.0
[mesh]
shape = "bar"
size = [0.02, 0.02, 0.1]
cells = [2, 2, 10]
element = "nodal-pressure"
[material]
law = "neo-hookean"
c = 500.0
d = 25000.0
density = 1000.0
[[fix]]
plane = { axis = "z", at = 0.0 }
[[force]]
nodes = [94]
newton = [0.01, 0.0, 0.0]
ramp = 0.1
[time]
step = 2e-4
end = 0.2
frames = 1
SCENE
    rm -rf "$folder/bar.out"
    target/release/supple simulate "$folder/bar.toml" --out "$folder/bar.out" >"$folder/said"
    "$folder/bar" | tee "$folder/bar.said"
    awk -F'[ ,]' '
        FNR == NR { for (i = 0; i < 3; i++) c[i] = $(5 + i); next }
        $1 == 94 {
            for (i = 0; i < 3; i++) { off += (c[i] - $(5 + i)) ^ 2; length2 += $(5 + i) ^ 2 }
            printf "the command is %.1e of that away\n", sqrt(off / length2)
            compared = 1
            exit !(sqrt(off) <= 1e-6 * sqrt(length2))
        }
        END { if (!compared) exit 1 }' "$folder/bar.said" "$folder/bar.out/final.csv"

    # The lobe: static memory only, and with an instrument, sixty frames a second.
    python3 tools/mesh_to_c.py meshes/lobe.msh "$folder/lobe_mesh.h"
    python3 tools/mesh_to_c.py --bytes weights/compact-10.weights compact "$folder/compact.h"
    gcc -std=c11 "${warnings[@]}" -I"$folder" "$wrapped" examples/lobe.c tests/capi/no_heap.c "$static" -lm -o "$folder/lobe"
    "$folder/lobe"
    g++ -std=c++17 "${warnings[@]}" examples/instrument.cpp "$shared" -Wl,-rpath,"$prefix/lib" -o "$folder/instrument"
    for method in exact long; do
        "$folder/instrument" --method $method --frames 60 --out "$folder/$method"
    done
    "$folder/instrument" --jitter 10000 --frames 1
    g++ -std=c++17 "${warnings[@]}" examples/press.cpp "$static" -o "$folder/press"
    "$folder/press"
    g++ -std=c++17 "${warnings[@]}" examples/pull.cpp "$static" -o "$folder/pull"
    "$folder/pull"

    # From Python.
    find_python
    for element in nodal-pressure nodal-strain; do
        "$python" examples/compare.py "$shared" target/release/supple $element
    done
}

memory() {
    local test options element
    for test in misuse copies simulation exchange relaxation fibres points heap strain threads; do
        options=(-pthread)
        [ $test != heap ] || options=("$wrapped")
        gcc -std=c11 "${warnings[@]}" "${options[@]}" -DSMALL -DUNDER_VALGRIND tests/capi/$test.c "$static" -o "$folder/$test-small"
    done
    for test in misuse copies simulation exchange relaxation fibres points heap strain; do
        valgrind --quiet --error-exitcode=9 --leak-check=full "$folder/$test-small" under-valgrind >"$folder/said"
    done
    echo "valgrind: no error in misuse, copies, simulation, exchange, relaxation, fibres, points, heap, strain"
    valgrind --quiet --error-exitcode=9 --tool=helgrind "$folder/threads-small" >"$folder/said"
    echo "helgrind: no race in threads"

    # The hosts with every access of their own checked, and what the library does in their memory as far as the C library sees it. Rust
    # has no sanitizers in a stable compiler, so within the library it is valgrind, and memory that must not be touched around every object
    # of the random calls.
    sanitized=(-fsanitize=address,undefined -fno-sanitize-recover=all)
    for test in misuse copies simulation exchange relaxation fibres points strain hostile; do
        element=()
        [ $test != strain ] || element=(-DELEMENT=SUPPLE_NODAL_STRAIN)
        gcc -std=c11 "${warnings[@]}" -O1 "${sanitized[@]}" -DSMALL "${element[@]}" tests/capi/$test.c "$static" -lm -o "$folder/$test-sanitized"
    done
    for test in misuse copies simulation exchange relaxation fibres points strain; do
        "$folder/$test-sanitized" >"$folder/said"
    done
    echo "sanitizers: no error in misuse, copies, simulation, exchange, relaxation, fibres, points, strain"
    "$folder/hostile-sanitized" 10000
}

openigtlink() {
    [ -e /usr/include/openigtlink ] || {
        apt-get update -qq && apt-get install -y -qq --no-install-recommends libopenigtlink-dev
    }
    find_python
    g++ -std=c++17 "${warnings[@]}" -isystem /usr/include/openigtlink examples/openigtlink.cpp "$static" -lOpenIGTLink -lpthread \
        -o "$folder/openigtlink"
    "$python" tests/hosts/openigtlink_client.py "$folder/openigtlink"
}

[ $# -gt 0 ] || set -- programs memory openigtlink
for part in "$@"; do
    case $part in
        programs | memory | openigtlink) "$part" ;;
        *)
            sed -n '2,10s/^# \{0,1\}//p' "$0" >&2
            exit 2
            ;;
    esac
done
