#!/usr/bin/env bash
# Runs the commands of the documentation (README.md, CONTRIBUTING.md, docs/, weights/, benches/, meshes/): those of fences marked `sh` as they stand,
# and of those marked `sh long`, which take minutes, only checks that what they name exists: tests, benchmarks, scripts, files,
# and the flags of the command. CI runs the long ones elsewhere, or the same with less data.
#
#     tools/docs.sh
set -euo pipefail
cd "$(dirname "$0")/.."

fail() {
    echo "failed: $1: $2" >&2
    exit 1
}

# fences FILE KIND: the lines of the fences of a kind.
fences() {
    awk -v opening="\`\`\`$2" '/^```/ { fenced = !fenced; inside = fenced && $0 == opening; next } inside' "$1"
}

# exists FILE LINE: what a line names is there.
exists() {
    local file=$1 line=$2 word
    case $line in
        cargo\ test*)
            for word in ${line#cargo test}; do
                case $word in
                    -*) ;;
                    *) if [[ $word =~ ^[a-z_0-9]{12,}$ ]]; then
                        grep -rqE "fn $word" tests src || fail "$file" "no test $word"
                    fi ;;
                esac
            done
            for word in $(grep -oE -- '--test [a-z_]+' <<<"$line" | cut -d' ' -f2); do
                [ -e "tests/$word.rs" ] || [ -e "tests/$word" ] || fail "$file" "no tests/$word"
            done
            ;;
        cargo\ bench*)
            for word in $(grep -oE -- '--bench [a-z_]+' <<<"$line" | cut -d' ' -f2); do
                [ -e "benches/$word.rs" ] || fail "$file" "no benches/$word.rs"
            done
            ;;
        cargo\ run*)
            local program=${line%% -- *} arguments=${line#* -- } sub
            sub=${arguments%% *}
            # Training would have to be built to be asked: its flags are names of fields.
            if [[ $program == *"--features train"* ]]; then
                for word in $(grep -oE -- ' --[a-z-]+' <<<"$arguments"); do
                    word=${word#--}
                    grep -rqw "${word//-/_}" src/lab/command || fail "$file" "$sub has no flag --$word"
                done
            else
                ${program/run/run --quiet} -- "$sub" --help >target/docs-help || fail "$file" "no command $sub"
                for word in $(grep -oE -- ' --[a-z-]+' <<<"$arguments"); do
                    case $sub in
                        weights) ;;
                        *) grep -q -- "$word" target/docs-help || fail "$file" "$sub has no flag $word" ;;
                    esac
                done
            fi
            ;;
    esac
    for word in $(grep -oE '\b(tools|tests|weights|docs|examples|meshes|benches)/[A-Za-z0-9_./*-]+' <<<"$line"); do
        compgen -G "$word" >/dev/null || fail "$file" "no $word"
    done
}

# The README's Rust stands in the crate's documentation, which is compiled and run; its C in examples/bar.c (tests/capi/run.sh).
awk '/^```rust/ { inside = 1; next } /^```/ { inside = 0 } inside' README.md | while read -r line; do
    grep -qF -- "$line" src/lib.rs || fail README.md "not in src/lib.rs: $line"
done

mkdir -p target out
for file in README.md CONTRIBUTING.md docs/*.md weights/*.md benches/README.md meshes/README.md; do
    fences "$file" "sh long" >target/docs-long
    while read -r line; do
        [ -z "$line" ] || exists "$file" "$line"
    done <target/docs-long
    fences "$file" sh >target/docs-short
    if [ -s target/docs-short ]; then
        bash -euo pipefail target/docs-short >target/docs-said 2>&1 || fail "$file" "$(tail -5 target/docs-said)"
    fi
    echo "ok: $file, $(wc -l <target/docs-short) commands run, $(wc -l <target/docs-long) long ones named rightly"
done
