#!/usr/bin/env bash
# Runs the commands of docs/guide.md (fences marked `sh guide`) one after the other, from nothing, and holds what comes of them
# against what must be.
#
#     tools/guide.sh [COMMAND]
#
# COMMAND is the built command, next to which COMMAND-lab stands, with training; without it the fences build both. `.ci/run` gives
# those of the tests.
set -euo pipefail
cd "$(dirname "$0")/.."

command=${1:-}
said=$(mktemp)
trap 'rm "$said"' EXIT
command -v python3 >/dev/null && python3 -c 'import ensurepip' 2>/dev/null || {
    apt-get update -qq && apt-get install -y -qq --no-install-recommends python3-venv
}
rm -rf out/guide
awk '/^```/ { inside = $0 == "```sh guide"; next } inside' docs/guide.md | while read -r line; do
    printf '$ %s\n' "$line"
    if [ -n "$command" ]; then
        line=${line/cargo run --release -p supple-lab --features train --/$command-lab}
        line=${line/cargo run --release --/$command}
    fi
    bash -euo pipefail -c "$line" 2>&1
done | tee "$said"

# within WHAT LEAST VALUE MOST
within() {
    awk -v least="$2" -v value="$3" -v most="$4" 'BEGIN { exit !(value != "" && value >= least && value <= most) }' || {
        echo "failed: $1 is '$3', it must be from $2 to $4" >&2
        exit 1
    }
}
value() { sed -n "s/$1/\1/p" "$said" | head -n "${2:-1}" | tail -n 1; }
within 'volume over that of the voxels, %' 90 "$(value '^volume.*, \([0-9.]*\) % of that of the voxels$')" 105
within 'E, kPa' 5.9 "$(value '.* E \([0-9.]*\) kPa, nu.*')" 6.1
within 'motion of the exact run, mm' 5 "$(value '^maximum displacement *\([0-9.]*\) mm.*')" 40
within 'force on the ball, N' 0.05 "$(value '^instruments *0: \([0-9.e+-]*\) N.*')" 1
within 'error of the learned run over time, % of not moving' 0 "$(value '^over time: .*, \([0-9.]*\) % of not moving;.*')" 40
within 'error of the learned run at its end, % of not moving' 0 "$(value '^at the end: .*: \([0-9.]*\) % of not moving$')" 40
# A network learns from exact steps without instruments, and says so.
sed 's,^scene = .*,scene = "../../docs/scenes/organ-touched.toml",' docs/scenes/organ-network.toml >out/guide/refused.toml
laboratory=${command:+$command-lab}
why=$(${laboratory:-cargo run --quiet --release -p supple-lab --features train --} train out/guide/refused.toml --out out/guide/refused.weights 2>&1) &&
    { echo 'failed: a network was trained on a scene with an instrument' >&2; exit 1; }
[[ $why == *organ-touched.toml*'the method is "auto"'* ]] || { echo "failed: it says: $why" >&2; exit 1; }
for file in organ_mesh.h organ_weights.h; do
    cc -std=c11 -Wall -Werror -fsyntax-only -x c "out/guide/$file"
done
echo 'ok: the guide leads from a label map to an embedded network'
