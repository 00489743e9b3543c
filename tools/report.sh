#!/usr/bin/env bash
# Makes small reports of all kinds with the command, and looks at them in headless Chromium: what is drawn, wide and narrow, light and dark.
#
#     tools/report.sh [COMMAND]
#
# COMMAND is the built command, next to which COMMAND-lab stands; without it they are built first. Reports and screenshots are in out/report. What the tests need comes from
# Debian (node, chromium) and from npm (pinned in examples/page/package-lock.json).
set -euo pipefail
cd "$(dirname "$0")/.."

missing=()
command -v npm >/dev/null || missing+=(nodejs npm)
command -v chromium >/dev/null || missing+=(chromium fonts-dejavu-core)
if [ ${#missing[@]} -gt 0 ]; then
    apt-get update -qq && apt-get install -y -qq --no-install-recommends "${missing[@]}"
fi
[ -d examples/page/node_modules/puppeteer-core ] || npm ci --prefix examples/page --no-audit --no-fund --silent
supple=${1:-target/release/supple}
[ -n "${1:-}" ] || cargo build --quiet --release

rm -rf out/report
mkdir -p out/report
"$supple" demo --out out/report/demo
"$supple" simulate docs/scenes/lobe-sphere.toml --out out/report/simulate
lab() { "$supple-lab" "$@" --out out/report/lab 2>/dev/null | tail -n 2; }
lab methods --scene reversed --scene cylinder --multiple 10 --multiple 20 \
    --method tled --method hold --method long --method compact-f32
lab physics --scene torsion
lab hard --scene slivers --scene release-stretched --random 4 --presses 2 --ordinary 2 --method long --method compact-f32
# Each part is there still after the others.
for title in 'Speed against error' 'Error against nature' 'Hard cases'; do
    grep -q "<h2>$title" out/report/lab/report.html || { echo "failed: no part '$title'" >&2; exit 1; }
done
SUPPLE_REPORTS="out/report/demo/report.html out/report/simulate/report.html out/report/lab/report.html" \
    node --test --test-reporter=spec tests/report/browser.test.mjs
