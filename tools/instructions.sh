#!/usr/bin/env bash
# Counts the instructions of the hot loops (benches/instructions.rs) under valgrind and compares them with those in
# benches/instructions.txt: fails if one needs over 3 % more. Fewer are news as well: --keep writes the new counts.
#
#     tools/instructions.sh [--keep]
set -euo pipefail
cd "$(dirname "$0")/.."

if ! command -v valgrind >/dev/null; then
    apt-get update -qq && apt-get install -y -qq --no-install-recommends valgrind
fi
kept=benches/instructions.txt
# With the command, whose library it shares.
cargo build --quiet --release --workspace
program=${CARGO_TARGET_DIR:-target}/release/instructions

# Instructions of a whole run; valgrind tells what it does not know and ends with the status of the program.
count() {
    local told
    if ! told=$(valgrind --tool=callgrind --callgrind-out-file=/dev/null "$program" "$1" "$2" 2>&1); then
        echo "$told" >&2
        return 1
    fi
    sed -n 's/.*Collected : \([0-9]*\).*/\1/p' <<<"$told"
}

counted=$(mktemp)
trap 'rm -f "$counted"' EXIT
for loop in $("$program"); do
    none=$(count "$loop" 0)
    some=$(count "$loop" 1)
    echo "$loop $((some - none))" | tee -a "$counted"
done
if [ "${1:-}" = --keep ]; then
    cp "$counted" "$kept"
    exit
fi
awk 'NR == FNR { kept[$1] = $2; next }
    !($1 in kept) { printf "%s is not in the kept counts\n", $1; bad = 1; next }
    { change = 100 * ($2 / kept[$1] - 1) }
    change > 3 { printf "%s needs %.1f %% more instructions than kept, %d\n", $1, change, kept[$1]; bad = 1 }
    change < -3 { printf "%s needs %.1f %% fewer instructions than kept: keep the new count\n", $1, -change }
    END { exit bad }' "$kept" "$counted"
