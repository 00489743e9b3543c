"""Builds the package: compiles the library with cargo and writes what cffi needs of its header. The rest is in pyproject.toml.

From a clone and from a source distribution alike, which has the library's crate in `rust`. Read from the environment:

    SUPPLE_LIBRARY          a libsupple.so with the features below that is there already, in place of compiling one
    CARGO                   the cargo to call
    CARGO_BUILD_TARGET      another processor, as for any call of cargo
    CARGO_PROFILE_RELEASE_LTO, _CODEGEN_UNITS
                            "false" and 16 compile in half of the time, for steps that are a few per cent slower
"""

import json
import os
import pathlib
import re
import shutil
import subprocess
import sys
import tarfile
import tempfile

from setuptools import Distribution, setup
from setuptools.command.bdist_wheel import bdist_wheel
from setuptools.command.build_py import build_py
from setuptools.command.sdist import sdist

HERE = pathlib.Path(__file__).resolve().parent
RUST = HERE / "rust" if (HERE / "rust").is_dir() else HERE.parents[1]
FEATURES = "capi,io,parallel"
# Libraries that every Linux with glibc has.
EVERYWHERE = {"libc.so.6", "libm.so.6", "libpthread.so.0", "libdl.so.2", "libgcc_s.so.1", "ld-linux-x86-64.so.2", "ld-linux-aarch64.so.1"}


def cargo(*arguments: str) -> str:
    """What cargo prints on a call for the library."""
    # All of it as one unit, as tools/install.sh does.
    settings = {"CARGO_PROFILE_RELEASE_LTO": "fat", "CARGO_PROFILE_RELEASE_CODEGEN_UNITS": "1", "CARGO_PROFILE_RELEASE_PANIC": "abort"}
    command = [os.environ.get("CARGO", "cargo"), *arguments]
    try:
        done = subprocess.run(command, cwd=RUST, env=settings | os.environ, stdout=subprocess.PIPE, text=True)
    except FileNotFoundError:
        raise SystemExit(f"supple: {command[0]} is not there: to build this package Rust is needed (https://rustup.rs)") from None
    if done.returncode:
        raise SystemExit(f"supple: {' '.join(command)} failed in {RUST}")
    return done.stdout


def built_library() -> pathlib.Path:
    if not sys.platform.startswith("linux"):
        raise SystemExit(f"supple: the package is for Linux, not for {sys.platform}")
    if not (RUST / "include" / "supple.h").is_file():
        raise SystemExit(f"supple: the library's sources are not in {RUST}: build from a clone or a source distribution, with pip 21.3 or later")
    if given := os.environ.get("SUPPLE_LIBRARY"):
        if not pathlib.Path(given).is_file():
            raise SystemExit(f"supple: SUPPLE_LIBRARY: there is no file {given}")
        return pathlib.Path(given)
    told = cargo("rustc", "--package=supple", "--locked", "--quiet", "--release", "--lib", "--crate-type=cdylib", f"--features={FEATURES}",
                 "--message-format=json-render-diagnostics")
    units = [json.loads(line) for line in told.splitlines()]
    files = [file for unit in units if unit.get("target", {}).get("name") == "supple" for file in unit.get("filenames", [])]
    return next(pathlib.Path(file) for file in files if file.endswith(".so"))


def platform(library: pathlib.Path) -> str:
    """The tag of what a library runs on: its processor, and the glibc that it asks for. Weak symbols may be missing."""
    def elf(option: str) -> str:
        return subprocess.run(["readelf", "--wide", option, library], env=os.environ | {"LC_ALL": "C"}, check=True, capture_output=True, text=True).stdout

    if shutil.which("readelf") is None:
        raise SystemExit("supple: readelf is not there (binutils)")
    machine = "aarch64" if "AArch64" in elf("--file-header") else "x86_64" if "X86-64" in elf("--file-header") else os.uname().machine
    needed = set(re.findall(r"\(NEEDED\).*\[(.*)\]", elf("--dynamic")))
    glibc = [(int(major), int(minor)) for major, minor in re.findall(r"Name: GLIBC_(\d+)\.(\d+)\S* +Flags: none", elf("--version-info"))]
    return "manylinux_{}_{}_{}".format(*max(glibc), machine) if glibc and needed <= EVERYWHERE else f"linux_{machine}"


class WithLibrary(Distribution):
    """A package for one processor."""

    library: pathlib.Path | None = None

    def has_ext_modules(self) -> bool:
        return True


class Build(build_py):
    def run(self) -> None:
        if not self.editable_mode: # what an earlier build has left
            shutil.rmtree(self.build_lib, ignore_errors=True)
        super().run()
        folder = HERE / "supple" if self.editable_mode else pathlib.Path(self.build_lib, "supple")
        self.distribution.library = built_library()
        shutil.copy(self.distribution.library, folder / "libsupple.so")
        shutil.copy(RUST / "meshes" / "lobe.msh", folder)
        subprocess.run([sys.executable, HERE / "build_interface.py", RUST / "include" / "supple.h", folder], check=True)


class Wheel(bdist_wheel):
    def get_tag(self) -> tuple[str, str, str]:
        """Nothing in it is compiled for a Python."""
        return "py3", "none", platform(self.distribution.library) if self.distribution.library else super().get_tag()[2]


class Sources(sdist):
    def make_release_tree(self, base_dir: str, files: list[str]) -> None:
        """With the library as its crate has it, and the mesh."""
        super().make_release_tree(base_dir, files)
        rust = pathlib.Path(base_dir, "rust")
        if RUST.parent == HERE:
            shutil.copytree(RUST, rust, ignore=shutil.ignore_patterns("target"))
            return
        with tempfile.TemporaryDirectory() as target:
            cargo("package", "--package=supple", "--no-verify", "--allow-dirty", "--quiet", f"--target-dir={target}")
            with tarfile.open(next(pathlib.Path(target, "package").glob("supple-*.crate"))) as crate:
                # Debian 12's Python has no filters yet.
                crate.extraction_filter = getattr(tarfile, "data_filter", None)
                crate.extractall(base_dir)
                pathlib.Path(base_dir, crate.getnames()[0].split("/")[0]).rename(rust)
        with open(rust / "Cargo.toml", "a") as manifest:
            manifest.write("\n[workspace]\n") # of its own, wherever it is unpacked
        (rust / "meshes").mkdir()
        shutil.copy(RUST / "meshes" / "lobe.msh", rust / "meshes")


setup(distclass=WithLibrary, cmdclass={"build_py": Build, "bdist_wheel": Wheel, "sdist": Sources})
