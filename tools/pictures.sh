#!/usr/bin/env bash
# Makes the pictures of README.md and docs/ from real runs: the demo, an evaluation, the web page. Those of the physics cases come from
# tools/physics_docs.sh.
#
#     tools/pictures.sh
#
# Takes about five minutes after the builds; runs are in out/pictures. The evaluation's truths stay there, so that it can go on.
set -euo pipefail
cd "$(dirname "$0")/.."

tools/page.sh --build
[ -d examples/page/node_modules/puppeteer-core ] || npm ci --prefix examples/page --no-audit --no-fund --silent
cargo build --quiet --release
out=out/pictures
mkdir -p "$out" docs/pictures
target/release/supple demo --out "$out/demo"
scenes=(reversed stretch compression compression-neo-hookean cylinder lobe)
methods=(tled hold tled-large-step long compact-f32 paper-f32)
target/release/supple-lab methods "${scenes[@]/#/--scene=}" "${methods[@]/#/--method=}" --out "$out/lab" >"$out/lab.txt"
node tools/pictures.mjs "$out" docs/pictures
