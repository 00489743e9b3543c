#!/usr/bin/env bash
# Runs the physics cases and puts what they give into the documentation: the tables into docs/accuracy.md, between the two comments
# there, and the pictures into docs/pictures.
#
#     tools/physics_docs.sh
set -euo pipefail
cd "$(dirname "$0")/.."

out=target/physics
cargo run --quiet --release -p supple-lab -- physics --out "$out" >"$out.txt"
mkdir -p docs/pictures
cp "$out/physics.svg" "$out/locking.svg" docs/pictures/
awk -v tables="$out/physics.md" '
    /^<!-- end of the tables/ { inside = 0 }
    !inside
    /^<!-- tables of/ { inside = 1; print ""; while ((getline line < tables) > 0) print line; print "" }
' docs/accuracy.md >"$out/accuracy.md"
cp "$out/accuracy.md" docs/accuracy.md
echo "ok: docs/accuracy.md, docs/pictures"
