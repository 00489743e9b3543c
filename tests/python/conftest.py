"""What the tests of the Python package share: the repository's meshes, and a soft bar."""

import pathlib

import pytest
import supple

ROOT = pathlib.Path(__file__).parents[2]


def bar(cells=(3, 3, 8), size=(0.02, 0.02, 0.06)):
    return supple.Mesh.box(size, cells)


@pytest.fixture(scope="session")
def soft():
    return supple.Material.from_moduli(3000.0, 0.45, density=1000.0)


@pytest.fixture(scope="session")
def lobe():
    return supple.Mesh.read(ROOT / "meshes" / "lobe.msh")


@pytest.fixture(scope="session")
def liver():
    return supple.Material("exponential", a=1500.0, b=8.023, d=40000.0, density=1060.0)
