#!/usr/bin/env bash
# Checks what tells of the whole: every file says whose it is and under which licence (REUSE.toml), CITATION.cff is one, all packages have
# the crate's version, and the bills of materials that tools/sbom.py writes are what CycloneDX says.
#
#     tools/papers.sh
#
# What it needs comes from PyPI into target/papers, where the bills are left.
set -euo pipefail
cd "$(dirname "$0")/.."

folder=$PWD/target/papers
rm -rf "$folder"
mkdir -p "$folder"
python3 -c 'import ensurepip' 2>/dev/null || {
    apt-get update -qq && apt-get install -y -qq --no-install-recommends python3-venv
}
# Each by itself, as they need other versions of the same.
tool() { python3 -m venv "$folder/$1" && "$folder/$1/bin/pip" install --quiet "$2"; }
tool reuse reuse==6.2.0
tool cff cffconvert==2.0.0
tool cyclonedx 'cyclonedx-python-lib[json-validation]==11.12.0'

"$folder/reuse/bin/reuse" lint --lines
echo "ok: the licence of each file"
"$folder/cff/bin/cffconvert" --validate

version=$(sed -n 's/^version = "\(.*\)"/\1/p' Cargo.toml | head -1)
for file in src/python/pyproject.toml src/javascript/package.json src/javascript/package-lock.json CITATION.cff src/bin/supple/Cargo.toml; do
    grep -qE "version\"?( =|:) \"?$version\"?" "$file" || { echo "$file: not version $version" >&2; exit 1; }
done
echo "ok: version $version everywhere"

for build in supple 'supple capi,io,parallel' supple-cli; do
    bill="$folder/${build//[ ,]/-}.cdx.json"
    # shellcheck disable=SC2086 # A package and its features.
    tools/sbom.py $build >"$bill"
    "$folder/cyclonedx/bin/python" - "$bill" <<'END'
import sys
from cyclonedx.schema import SchemaVersion
from cyclonedx.validation.json import JsonStrictValidator

text = open(sys.argv[1]).read()
problem = JsonStrictValidator(SchemaVersion.V1_6).validate_str(text)
sys.exit(f"{sys.argv[1]}: {problem}" if problem else 0)
END
    echo "ok: $bill, $(grep -c '"bom-ref"' "$bill") crates"
done
