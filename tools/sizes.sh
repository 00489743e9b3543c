#!/usr/bin/env bash
# Prints, as a Markdown table, the bytes that the C library adds to programs that use more or less of it: on a
# microcontroller with a Cortex-M4F, compiled for speed and for size, and on x86-64 Linux. Takes a quarter of an hour.
#
#     tools/sizes.sh [FOLDER]
#
# FOLDER (target/cross) is the one in which tools/cross.sh has put a compiler for other processors.
set -euo pipefail
cd "$(dirname "$0")/.."

folder=$(realpath "${1:-target/cross}")
if ! [ -e "$folder/cargo" ]; then
    echo "$folder holds no compiler: tools/cross.sh puts one there" >&2
    exit 1
fi
lld=$(rustc --print sysroot)/lib/rustlib/x86_64-unknown-linux-gnu/bin/rust-lld
libraries=$folder/sizes
mkdir -p "$libraries"

# As the installer does.
export CARGO_PROFILE_RELEASE_LTO=fat CARGO_PROFILE_RELEASE_CODEGEN_UNITS=1

# thumb FEATURES LEVEL: the static library for the microcontroller, compiled by the compiler in FOLDER.
thumb() {
    CARGO_PROFILE_RELEASE_OPT_LEVEL=$2 CARGO_PROFILE_RELEASE_LTO=fat CARGO_PROFILE_RELEASE_CODEGEN_UNITS=1 \
        "$folder/cargo" rustc -p supple --quiet --release --lib --features "$1,panic-handler" \
        --crate-type staticlib --target thumbv7em-none-eabihf -Zbuild-std=core --target-dir "$libraries/build"
    cp "$libraries/build/thumbv7em-none-eabihf/release/libsupple.a" "$libraries/thumb-$2-$1.a"
}

for features in capi capi-neo-hookean capi-neo-hookean,contact; do
    thumb $features 3
    thumb $features s
    tools/install.sh --prefix "$libraries/$features" --features $features >/dev/null
    cp "$libraries/$features/lib/libsupple.a" "$libraries/x86-64-$features.a"
done

mapfile -t all < <(gcc -E -P include/supple.h | grep -o '\bsupple_[a-z_]*(' | tr -d '(' | sort -u)
exact=(
    supple_scene_{init,size} supple_state_{init,size,time,reset} supple_loads_{init,size}
    supple_set_{gravity,forces,motions,step} supple_critical_step supple_step
    supple_displacements supple_copy_{displacements,positions,velocities,forces}
)
contact=(supple_contact_{size,init,points} supple_set_{instruments,contact} supple_move_instrument supple_grasp supple_let_go supple_read_touch)
learned=(supple_learned_{size,init,reset,describe,lead,step})

# count LIBRARY FUNCTIONS...: code with its constants, data, zeroed data of a program that calls the functions. The host
# has memcpy and its like.
count() {
    local library=$1
    shift
    "$lld" -flavor gnu --gc-sections --entry=0 "${@/#/--undefined=}" --defsym=memcpy=0 --defsym=memmove=0 --defsym=memset=0 \
        --defsym=memcmp=0 --defsym=bcmp=0 "$libraries/$library.a" -o "$libraries/program"
    local kept
    kept=$(nm "$libraries/program" | grep -c ' T supple_')
    if [ "$kept" -lt $# ]; then
        echo "$kept functions of $# are in $library.a" >&2
        exit 1
    fi
    size -A "$libraries/program" | awk '
        $1 ~ /^\.(text|rodata|data\.rel\.ro|got)/ { code += $2; next }
        $1 ~ /^\.(data|tdata)/ { data += $2 }
        $1 ~ /^\.(bss|tbss)/ { zeroed += $2 }
        END { printf " %d | %d |", code, data + zeroed }'
}

# row NAME FEATURES FUNCTIONS...
row() {
    printf '| %s |' "$1"
    for library in thumb-3 thumb-s x86-64; do
        count "$library-$2" "${@:3}"
    done
    echo
}

echo '| | Cortex-M4F: code and constants | data | the same for size: code and constants | data | x86-64: code and constants | data |'
echo '|---|---:|---:|---:|---:|---:|---:|'
row 'Exact steps, neo-Hookean' capi-neo-hookean "${exact[@]}"
row 'Exact steps with instruments, neo-Hookean' capi-neo-hookean,contact "${exact[@]}" "${contact[@]}"
row 'Exact steps, all laws and elements, instruments' capi "${exact[@]}" "${contact[@]}"
row 'Exact and learned steps, neo-Hookean' capi-neo-hookean "${exact[@]}" "${learned[@]}"
row 'Exact and learned steps, all laws and elements' capi "${exact[@]}" "${learned[@]}"
row 'Everything' capi "${all[@]}"
echo
echo "Learned steps need weights as well: $(stat -c %s weights/compact-10-i8.weights) bytes for a compact network in int8."
