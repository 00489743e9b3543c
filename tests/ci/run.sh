#!/usr/bin/env bash
# Tests of .ci/check and .ci/kept in repositories and a cache folder of their own.
#
#     tests/ci/run.sh
set -euo pipefail
cd "$(dirname "$0")/../.."

made=$(mktemp -d)
trap 'rm -rf "$made"' EXIT
export XDG_CACHE_HOME=$made/cache GIT_CONFIG_GLOBAL=/dev/null
unset CI_ALL CI_SUMMARY CARGO_TARGET_DIR CARGO_BUILD_BUILD_DIR

fail() {
    echo "failed: $*" >&2
    exit 1
}
ok() { echo "ok: $*"; }

# A repository with a package that has one dependency, and with scripts.
mkdir -p "$made/one/src" "$made/one/other" "$made/one/.ci"
cp .ci/check .ci/kept "$made/one/.ci"
cd "$made/one"
echo 'fn main() { cfg_if::cfg_if! { if #[cfg(all())] { println!("first") } } }' >src/main.rs
printf '[package]\nname = "small"\nversion = "0.0.0"\nedition = "2024"\n[dependencies]\ncfg-if = "=1.0.4"\n' >Cargo.toml
echo target >.gitignore
echo text >src/text
echo text >other/text
printf '#!/bin/sh\ncat src/text >>../seen\n' >see.sh
chmod +x see.sh
git init --quiet
git add .
cargo generate-lockfile --quiet
git add .
git -c user.name=A -c user.email=a@a commit --quiet -m first

# runs / skips WHAT: what the check of see.sh does now.
runs() {
    : >"$made/seen"
    .ci/check see --inputs src --tools "${tools:-git}" -- ./see.sh "${arguments[@]}" >"$made/said" || fail "the check fails: $(<"$made/said")"
    [ -s "$made/seen" ] || fail "skipped: $1"
    ! grep -q skipped "$made/said" || fail "it says that it was skipped: $1"
    ok "runs: $1"
}
skips() {
    : >"$made/seen"
    .ci/check see --inputs src --tools "${tools:-git}" -- ./see.sh "${arguments[@]}" >"$made/said"
    [ ! -s "$made/seen" ] || fail "runs: $1"
    grep -q 'see: skipped, unchanged since it passed on 2' "$made/said" || fail "it does not say that it was skipped: $1"
    ok "skipped: $1"
}
arguments=()
runs 'a check that never ran'
skips 'the same inputs'
echo more >other/text
skips 'a change outside of the inputs'
printf 'texT\n' >src/text
runs 'a changed byte that is not committed'
skips 'the same changed byte'
git -c user.name=A -c user.email=a@a commit --quiet --all -m second
skips 'the change committed'
echo text >src/text
skips 'the content of before'
touch src/text
skips 'a file of another date'
echo new >src/new
runs 'a new file'
rm src/new src/text
git show HEAD^:src/text >src/text
skips 'the new file removed'
chmod +x src/text
runs 'a file that can be executed'
chmod -x src/text
mv src/text src/moved
ln -s moved src/text
runs 'a file with another name'
rm src/text
mv src/moved src/text
echo '# more' >>see.sh
runs 'a changed script'
arguments=(-v)
runs 'another argument'
arguments=()
tools='git bash'
runs 'another tool'
tools=git
SUPPLE_TRY=1 runs 'a variable that tests read'
CI_ALL=1 runs 'all checks asked for'
skips 'after all were asked for'

git clone --quiet . "$made/two"
cd "$made/two"
skips 'another clone, of content that passed in the first'
echo two >src/text
runs 'other content in another clone'
cd "$made/one"
git checkout --quiet .
echo two >src/text
skips 'the first clone with that content'

for status in 1 3; do
    got=0
    .ci/check fails --inputs src -- sh -c "exit $status" >"$made/said" || got=$?
    [ $got = $status ] || fail "a check that fails with $status gives $got"
done
got=0
.ci/check fails --inputs src -- sh -c "exit 3" >"$made/said" || got=$?
[ $got = 3 ] || fail 'a failed check was recorded'
ok 'a failure is not recorded'
.ci/check changes --inputs src -- sh -c 'date +%N >>src/text' >"$made/said"
grep -q 'not recorded: its inputs have changed' "$made/said" || fail 'recorded though its inputs changed'
git checkout --quiet src
ok 'what changes its inputs is not recorded'
! .ci/check slip --inputs 'src sources' -- true >"$made/said" 2>&1 || fail 'a path without files is taken'
ok 'a path without files is refused'
for record in "$XDG_CACHE_HOME"/supple-ci/passed/see/*; do : >"$record"; done
runs 'an empty record'
rm -r "$XDG_CACHE_HOME/supple-ci/passed/see"
: >"$XDG_CACHE_HOME/supple-ci/passed/see"
runs 'no folder for the record'
grep -q 'not recorded' "$made/said" || fail 'it does not say that there is no record'

# build WHAT: compiles and runs the package with kept dependencies.
build() {
    CARGO_BUILD_BUILD_DIR=$(.ci/kept open) cargo run >"$made/told" 2>"$made/said" || fail "$(<"$made/said")"
    .ci/kept close
    [ "$(<"$made/told")" = "$1" ] || fail "the program says $(<"$made/told"), not $1"
}
compiled() { grep -q "Compiling $1" "$made/said"; }
build first
compiled cfg-if || fail 'nothing was compiled'
build first
! compiled small || fail 'the package was compiled again'
ok 'the same clone has everything compiled'
cd "$made/two"
sed -i s/first/other/ src/main.rs
touch -d 2020-01-01 src/main.rs Cargo.*
build other
! compiled cfg-if || fail 'a dependency was compiled again'
compiled small || fail 'the package was not compiled again'
ok 'another clone has the dependencies compiled, and its own package anew, whatever its date'
cd "$made/one"
.ci/kept open >"$made/said"
! find "$XDG_CACHE_HOME/supple-ci/build" | grep small || fail 'the above of the package of another clone is kept'
.ci/kept close
ok 'nothing of the package of another clone is kept'
cd "$made/two"
library=$(find "$XDG_CACHE_HOME/supple-ci/build" -name 'libcfg_if*.rlib')
truncate -s 100 "$library"
build other
compiled cfg-if || fail 'a damaged dependency was used'
ok 'a damaged folder is not used'
CARGO_BUILD_BUILD_DIR=$(.ci/kept open) cargo build --quiet
build other
compiled cfg-if || fail 'a folder was used that was not closed'
ok 'a folder that a killed run has left is not used'
