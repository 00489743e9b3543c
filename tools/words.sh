#!/usr/bin/env bash
# Fails if a word that this project has given up for a standard term (docs/GLOSSARY.md) comes back.
#
#     tools/words.sh
#
# Each line below: the pattern, what is meant instead, and where the word is right (a pattern of lines, or nothing).
set -euo pipefail
cd "$(dirname "$0")/.."

found=0
# word PATTERN INSTEAD [RIGHT]
word() {
    local lines
    lines=$(git grep -InwiE -e "$1" -- . ':!CHANGELOG.md' ':!tools/words.sh' ':!*.lock' ':!tests/data' ':!LICENSE*' || true)
    if [ -n "${3:-}" ]; then lines=$(grep -vE -e "$3" <<<"$lines" || true); fi
    if [ -n "$lines" ]; then
        printf 'say "%s":\n%s\n' "$2" "$lines" >&2
        found=1
    fi
}

word 'lanes' 'simd, or the elements of a vector'
word 'chains?' 'strip' '\.chain\('
word 'chunks?' 'partition' '\.chunks\('
word 'seats?' 'partition layout'
# Files of meshes and compressed data have blocks, and so has Rust.
word 'blocks?' 'tile' ':block\b|unsafe block|^(src|tests)/io/|^docs/scene-file.md'
word 'beside|[a-z_]+_beside' 'off-diagonal, or next to'
word 'waiting' 'scatter buffer'
word 'numbering|numbers for nodes' 'renumbering'
word 'one[ _]by[ _]one' 'scalar'
word 'brake[ds]?|braking' 'velocity scale'
word 'ledgers?' 'energy balance'
word 'insists?' 'unchecked'
word 'large steps?' 'long steps' '^docs/GLOSSARY.md:[0-9]+:\*\*Long step'
# Its former name in scene files is still read.
word 'surrogates?' 'learned step' '^src/bin/supple/.*alias = "surrogate"|^tests/command/'
# As above.
word 'burn[_-]in' 'lead-in' '^docs/GLOSSARY.md|^src/bin/supple/.*alias = "burn_in"|^tests/command/'
word 'the C face' 'the C API'
word 'rooms' 'modules'

# Names of types and functions.
names=$(git grep -nE '\b(Following|Chosen|Prepare|Settle|Calm|Alone|Beside|Waiting)( *[({<]|::)|(::|fn )over\(' -- '*.rs' || true)
if [ -n "$names" ]; then
    printf 'names that were given up:\n%s\n' "$names" >&2
    found=1
fi
[ "$found" = 0 ] && echo "ok: no old words"
exit "$found"
