"""Writes _interface.py, what cffi needs of include/supple.h, and _laws.py, its laws with their constants: run by setup.py.

    python build_interface.py HEADER FOLDER

The header is the only place where structures, functions and numbers are declared.
"""

import io
import pathlib
import re
import sys

import cffi
import pcpp


def declarations(header: str) -> str:
    """The header as cffi reads it: preprocessed, and its plain numbers as constants."""
    preprocessor = pcpp.Preprocessor()
    preprocessor.line_directive = None
    for name in ("__STDC_VERSION__ 201112L", "SUPPLE_IO 1", "SUPPLE_PARALLEL 1"):
        preprocessor.define(name)
    preprocessor.parse(re.sub(r"^#include.*$", "", header, flags=re.M))
    text = io.StringIO()
    preprocessor.write(text)
    numbers = re.findall(r"^#define (SUPPLE_\w+) \(?(\d+|UINT32_MAX)\)?(?: /\*.*\*/)?$", header, flags=re.M)
    constants = [f"#define {name} {0xFFFFFFFF if value == 'UINT32_MAX' else value}" for name, value in numbers]
    return text.getvalue() + "\n".join(constants)


def laws(header: str) -> str:
    """The laws by name: number, and names of the constants in their order."""
    part = header.split("/* Laws", 1)[1].split("/* Sizes", 1)[0]
    entries = re.findall(r"^#define SUPPLE_(\w+) (\d+) /\* (.*) \*/$", part, flags=re.M)
    lines = ["# Made by build_interface.py from include/supple.h.", "LAWS = {"]
    for name, number, constants in entries:
        names = tuple(re.findall(r"(\w+)(?: \(\w+\))?", constants.replace(" (Pa)", "")))
        lines.append(f"    {name.lower().replace('_', '-')!r}: ({number}, {names!r}),")
    return "\n".join([*lines, "}", ""])


def main() -> None:
    header = pathlib.Path(sys.argv[1]).read_text()
    folder = pathlib.Path(sys.argv[2])
    builder = cffi.FFI()
    builder.cdef(declarations(header))
    builder.set_source("supple._interface", None)
    builder.emit_python_code(str(folder / "_interface.py"))
    (folder / "_laws.py").write_text(laws(header))


main()
