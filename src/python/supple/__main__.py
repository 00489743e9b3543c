"""The command `python -m supple`: a demonstration, and what needs SimpleITK, which the command `supple` does without."""

from __future__ import annotations

import argparse
import json
import pathlib
import sys
import warnings

import numpy as np
from numpy.typing import NDArray

from .demo import demo
from .errors import Error, InputError
from .images import displacement_field, grid_for_warping, read_image, write_image
from .mesh import Mesh


def read_run(folder: pathlib.Path) -> tuple[Mesh, NDArray[np.float64]]:
    """The mesh at rest and the last displacements (m) of a folder that `supple simulate` has written."""
    frames, table = sorted(folder.glob("frame_*.vtu")), folder / "final.csv"
    if not frames or not table.is_file():
        raise InputError(f"{folder}: there is no frame_*.vtu or no final.csv: give a folder that `supple simulate --out` has written")
    _believed(folder / "summary.json")
    mesh = Mesh.read(frames[-1])
    try:
        rows = np.loadtxt(table, delimiter=",", skiprows=1, ndmin=2)
    except ValueError as problem:
        raise InputError(f"{table}: {problem}") from None
    if rows.shape != (len(mesh.points), 7) or not np.allclose(rows[:, 1:4], mesh.points, rtol=1e-6, atol=1e-9):
        raise InputError(f"{table}: not of the mesh of {frames[-1].name}: give the folder of one run")
    return mesh, rows[:, 4:]


def _believed(summary: pathlib.Path) -> None:
    """Refuses a run that did not end, and tells of one that is not `ok`."""
    try:
        told = json.loads(summary.read_text("utf-8"))
        status, settled = str(told["status"]), told["settled"]
    except (OSError, ValueError, KeyError, TypeError):
        raise InputError(f"{summary}: there is none, or it is not one of `supple simulate`: give the folder of a whole run") from None
    if status == "diverged":
        raise InputError(f"{summary}: the run diverged, its last displacements are those of a refused step: mend the scene first")
    if status != "ok" or (settled is not None and not settled["at_rest"]):
        what = f"the status is {status}" if status != "ok" else "the body did not come to rest"
        warnings.warn(f"{summary}: {what}; see its report before you rely on the image", RuntimeWarning, stacklevel=3)


def warp(arguments: argparse.Namespace) -> None:
    mesh, displacements = read_run(arguments.run)
    image = read_image(arguments.image)
    grid = grid_for_warping(image)
    axes = "RAS" if arguments.ras else "LPS"
    field = displacement_field(mesh, displacements, grid, reach=arguments.reach, axes=axes)
    write_image(field.warp(image, labels=arguments.labels), arguments.out)
    if arguments.field is not None:
        field.write(arguments.field)
    lengths = 1e3 * np.linalg.norm(displacements, axis=1)
    print(f"{arguments.out}: {field.inside} of {np.prod(grid.size)} points of the field within the tissue, which moved by up to {lengths.max():.2f} mm")


def show(arguments: argparse.Namespace) -> None:
    try:
        print(demo(arguments.out))
    except OSError as problem:
        raise InputError(f"{arguments.out}: cannot be written: {problem.strerror}") from None


def parser() -> argparse.ArgumentParser:
    top = argparse.ArgumentParser(prog="python -m supple", description="A demonstration, and what needs images; all else is in the command supple.")
    commands = top.add_subparsers(required=True, metavar="COMMAND")
    asked = commands.add_parser("warp", help="warp an image with the last displacements of a simulation")
    asked.add_argument("run", type=pathlib.Path, metavar="RUN", help="folder that `supple simulate` has written")
    asked.add_argument("--image", required=True, type=pathlib.Path, help="the image at rest: .nrrd, .mha, .nii.gz")
    asked.add_argument("--out", required=True, type=pathlib.Path, help="the warped image, on the same grid")
    asked.add_argument("--field", type=pathlib.Path, help="write the field as well: .h5 or .tfm for a transform, .nrrd, .mha or .nii.gz for vectors")
    asked.add_argument("--labels", action="store_true", help="the image is a map of labels: nearest voxel in place of linear interpolation")
    asked.add_argument("--reach", type=float, default=0.0, metavar="MM", help="how far from the tissue the field ends; without, it goes on")
    asked.add_argument("--ras", action="store_true", help="the mesh is in RAS axes, and not in those of the image, LPS")
    asked.set_defaults(run_command=warp)
    shown = commands.add_parser("demo", help="a liver lobe under a ball, in exact and in long steps: a table and a picture")
    shown.add_argument("--out", type=pathlib.Path, default=pathlib.Path("supple-demo.svg"), help="the picture, as SVG (supple-demo.svg)")
    shown.set_defaults(run_command=show)
    return top


def main(given: list[str] | None = None) -> int:
    arguments = parser().parse_args(given)
    try:
        with warnings.catch_warnings(record=True) as said:
            warnings.simplefilter("always", RuntimeWarning)
            arguments.run_command(arguments)
    except (Error, ImportError) as problem:
        print(f"error: {problem}", file=sys.stderr)
        return 2
    for warning in said:
        print(f"warning: {warning.message}", file=sys.stderr)
    return 0


if __name__ == "__main__":
    sys.exit(main())
