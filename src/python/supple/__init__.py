"""Soft tissue in real time. SI units: m, kg, s, N, Pa.

From a mesh to a deformed one, in ten lines:

    import supple

    mesh = supple.Mesh.read("lobe.msh")
    material = supple.Material.from_moduli(young=10_000.0, poisson=0.45, density=1060.0)
    scene = supple.Scene(mesh, material, fixed=mesh.points[:, 1] > 0.03)
    simulation = supple.Simulation(scene, damping=20.0, gravity=(0.0, 0.0, -9.81))
    report = simulation.advance(1.0)
    print(report.status, 1e3 * abs(simulation.displacements).max(), "mm")
    simulation.write("deformed.vtu")
"""

from ._library import lib as _lib
from .errors import Diverged, Error, InputError, UnstableStep
from .fitting import Fit, fit
from .images import Field, Grid, displacement_field, read_image, write_image
from .instruments import Instrument, LocalForce, Touch
from .mesh import Mesh
from .points import FollowedPoints, Rigid, rigid_fit
from .pulls import Pulls
from .reactions import Reaction, ReactionForce
from .scene import Material, Scene
from .shape import Unloaded, unloaded
from .simulation import METHODS, Pressure, Report, Settled, Simulation

__all__ = [
    "METHODS", "Diverged", "Error", "Field", "Fit", "FollowedPoints", "Grid", "InputError", "Instrument", "LocalForce", "Material", "Mesh",
    "Pressure", "Pulls", "Reaction", "ReactionForce", "Report", "Rigid", "Scene", "Settled", "Simulation", "Touch", "Unloaded", "UnstableStep",
    "displacement_field", "fit", "level", "read_image", "rigid_fit", "unloaded", "version", "write_image",
]


def level() -> str:
    """The instructions that steps use on this machine."""
    return ("portable", "avx2", "avx512", "neon", "simd128")[_lib.supple_level()]


def version() -> str:
    """Of the kernel."""
    from ._library import ffi

    return str(ffi.string(_lib.supple_version()), "ascii")


__version__ = version()
