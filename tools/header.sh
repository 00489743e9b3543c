#!/usr/bin/env bash
# Makes include/supple.h from src/capi as include/cbindgen.toml tells, with the laws of the list in src/material/mod.rs, which
# stand in include/supple.hpp as well. With --verify it changes nothing and fails if the headers are not those it would make.
#
#     tools/header.sh [--verify]
#
# Takes the cbindgen that the variable CBINDGEN names, or builds its own into the user's cache folder.
set -euo pipefail
cd "$(dirname "$0")/.."

# Other versions make other headers. Nobody waits for a fast one.
version=0.29.4
own=${XDG_CACHE_HOME:-~/.cache}/supple-ci/tools
cbindgen=${CBINDGEN:-$own/bin/cbindgen}
if [ -z "${CBINDGEN:-}" ] && [ "$("$cbindgen" --version 2>/dev/null)" != "cbindgen $version" ]; then
    env -u CARGO_BUILD_BUILD_DIR -u CARGO_TARGET_DIR \
        cargo install cbindgen --quiet --force --version "$version" --locked --root "$own" --config profile.release.opt-level=0 \
        --config profile.release.codegen-units=16 --config profile.release.lto=false
fi
if [ "$("$cbindgen" --version)" != "cbindgen $version" ]; then
    echo "$cbindgen is not cbindgen $version" >&2
    exit 1
fi
made=$(mktemp -d)
trap 'rm -r "$made"' EXIT

# For each law its number, its name as C has it, and its constants: cbindgen does not see into macros.
number=0
snake() { sed 's/\(.\)\([A-Z]\)/\1_\2/g; s/.*/\L&/' <<<"$1"; }
while read -r variant type; do
    name=$(snake "$variant")
    constants=$(grep -o 'Constant { name: "[^"]*", unit: "[^"]*" }' "src/material/$(snake "$type").rs" |
        sed 's/.*name: "\(.*\)", unit: "\(.*\)" }/\1 (\2)/; s/ ()$//' | paste -sd, | sed 's/,/, /g')
    [ -n "$constants" ] || { echo "src/material/$(snake "$type").rs names no constants" >&2; exit 1; }
    printf '#define SUPPLE_%s %d /* %s */\n' "${name^^}" "$number" "$constants" >>"$made/laws.h"
    printf '    %s = SUPPLE_%s, // %s\n' "$name" "${name^^}" "$constants" >>"$made/laws.hpp"
    number=$((number + 1))
done < <(sed -n '/^macro_rules! for_each_law/,/^}/s/^ *\([a-z_]*\) \(\w*\),$/\2 \1/p' src/material/mod.rs)
[ $number -gt 0 ] || { echo "src/material/mod.rs has no list of laws" >&2; exit 1; }

# All of src/capi as one file, in the order of mod.rs: nothing else is C's.
mapfile -t files < <(sed -n 's/^mod \(\w*\);$/src\/capi\/\1.rs/p' src/capi/mod.rs)
sed -e '/^\/\/!/d' -e '/^#!\[/d' -e '/^mod .*;$/d' src/capi/mod.rs "${files[@]}" >"$made/capi.rs"
"$cbindgen" --quiet --config include/cbindgen.toml --output "$made/raw.h" "$made/capi.rs"
sed -e "/^@laws@$/{r $made/laws.h" -e 'd}' "$made/raw.h" >"$made/supple.h"
sed -e "/^enum class law /,/^};/{/^enum class law /{r $made/laws.hpp" -e 'b};/^};/!d}' include/supple.hpp >"$made/supple.hpp"
for header in supple.h supple.hpp; do
    if [ "${1:-}" = --verify ]; then
        diff "include/$header" "$made/$header"
    else
        cp "$made/$header" "include/$header"
    fi
done
