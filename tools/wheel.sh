#!/usr/bin/env bash
# Builds the Python wheel and tests it from a clean virtual environment.
#
#     tools/wheel.sh [LIBRARY]
#
# LIBRARY: a libsupple.so with the features io and parallel that is there already; else one is built. The wheel is in target/wheel. Its
# library chooses its instructions itself and needs no more than glibc, of the version that the name of the wheel tells (that of the
# machine that built it, at most 2.34); nothing in the wheel is compiled for a Python: one wheel for every Python 3 on such an x86-64 Linux.
set -euo pipefail
cd "$(dirname "$0")/.."

folder=$PWD/target/wheel
library=${1:+$(realpath "$1")}
rm -rf "$folder"
mkdir -p "$folder"
python3 -c 'import ensurepip' 2>/dev/null || {
    apt-get update -qq && apt-get install -y -qq --no-install-recommends python3-venv
}
if [ -z "$library" ]; then
    tools/install.sh --prefix "$folder/installed" --features capi,io,parallel >/dev/null
    library=$folder/installed/lib/libsupple.so
fi
if readelf -dW "$library" | grep NEEDED | grep -vE '\[(libc\.so\.6|libgcc_s\.so\.1|ld-linux-x86-64\.so\.2)\]'; then
    echo "the library needs more than every Linux with glibc has" >&2
    exit 1
fi
# Weak symbols may be missing.
glibc=$(readelf -VW "$library" | sed -n 's/.*Name: GLIBC_\([0-9.]*\) *Flags: none.*/\1/p' | sort -V | tail -1)

# The package as it will be, without what earlier builds have left.
cp -r src/python "$folder/package"
cp "$library" "$folder/package/supple/libsupple.so"
python3 -m venv "$folder/build"
"$folder/build/bin/pip" install --quiet cffi==2.1.1 pcpp==1.30 setuptools==84.2.1 wheel==0.48.0 mypy==2.4.1 numpy==2.4.6
"$folder/build/bin/python" "$folder/package/build_interface.py" include/supple.h
"$folder/build/bin/mypy" --strict --no-error-summary --cache-dir "$folder/mypy" --config-file "$folder/package/pyproject.toml" "$folder/package/supple"
"$folder/build/bin/pip" wheel --quiet --no-deps --no-build-isolation --wheel-dir "$folder" "$folder/package"
"$folder/build/bin/python" -m wheel tags --remove --python-tag py3 --abi-tag none --platform-tag "manylinux_${glibc//./_}_x86_64" \
    "$folder"/supple-*.whl >/dev/null
ls -l "$folder"/supple-*.whl

python3 -m venv "$folder/clean"
"$folder/clean/bin/pip" install --quiet "$folder"/supple-*.whl -r tests/python/requirements.txt
cd "$folder" # not where the sources are
"$folder/clean/bin/python" -m pytest --quiet -p no:cacheprovider "$OLDPWD/tests/python"
