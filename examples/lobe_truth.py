"""What examples of registration share: errors, points that are far from each other, and truths. A truth is the lobe on a mesh of eight times as
many elements, of another kind, with an exponential law, gravity, supports and loads, none of which the registration knows."""

import numpy as np
import supple

STATES = ("packed", "retracted", "mobilised")


def refined(mesh):
    """Each tetrahedron in eight."""
    pairs = [(0, 1), (0, 2), (0, 3), (1, 2), (1, 3), (2, 3)]
    edges = np.sort(np.stack([mesh.tets[:, pair] for pair in pairs], axis=1), axis=2)
    unique, place = np.unique(edges.reshape(-1, 2), axis=0, return_inverse=True)
    a, b, c, d = mesh.tets.T
    ab, ac, ad, bc, bd, cd = (place.reshape(-1, 6) + len(mesh.points)).T
    eight = [(a, ab, ac, ad), (ab, b, bc, bd), (ac, bc, c, cd), (ad, bd, cd, d)]
    eight += [(ab, bc, ac, ad), (ab, bd, bc, ad), (bc, cd, ac, ad), (bc, bd, cd, ad)]
    middles = mesh.points[unique].mean(axis=1)
    return supple.Mesh(np.concatenate([mesh.points, middles]), np.concatenate([np.stack(each, axis=1) for each in eight]))


def spread(surface, first, count):
    """Points of the surface, each as far as can be from those before."""
    chosen, apart = [first], np.linalg.norm(surface - surface[first], axis=1)
    while len(chosen) < count:
        chosen.append(int(apart.argmax()))
        apart = np.minimum(apart, np.linalg.norm(surface - surface[chosen[-1]], axis=1))
    return chosen


def error(a, b):
    """Mean distance, mm."""
    return 1e3 * np.linalg.norm(a - b, axis=1).mean()


def truth(mesh, state):
    """The lobe at rest. Packed: it hangs from a patch of its back, lies on two pads, and is turned. Retracted: its front edge is lifted by
    25 mm. Mobilised: it is held at its thick end only, and has fallen to the side, onto two pads."""
    fine = refined(mesh)
    x, y, z = fine.points.T
    fixed, gravity, balls = {
        "packed": ((np.abs(x + 0.03) < 0.02) & (y > 0.025), (2.0, -3.0, -8.0), [(0.03, (0.03, -0.01, -0.03)), (0.02, (-0.04, -0.05, -0.03))]),
        "retracted": ((y > 0.03) & (x < 0.03), (0.0, 0.0, -9.8), []),
        "mobilised": (x < -0.05, (1.0, 4.0, -8.5), [(0.04, (0.05, 0.0, -0.055)), (0.03, (0.0, 0.03, -0.045))]),
    }[state]
    edge = np.flatnonzero(y < -0.045) if state == "retracted" else []
    material = supple.Material("exponential", a=1500.0, b=8.023, d=40000.0, density=1060.0)
    made = supple.Simulation(
        supple.Scene(fine, material, fixed=fixed, moved=edge, element="nodal-pressure"), damping=20.0, gravity=gravity
    )
    made.set_instruments([supple.Instrument.sphere(radius, centre) for radius, centre in balls])
    if len(edge):
        made.set_motions(edge, [[0.0, 0.006, 0.025]] * len(edge), ramp=0.5)
        made.advance(0.6)
    print(f"{state}: {made.settle(1e-4)}")
    return made
