#!/usr/bin/env python3
"""Makes meshes/lobe.msh and meshes/cylinder.msh, the crate's two tetrahedral test bodies.

The lobe is a liver-like organ: a dome above, a gently hollow underside, a thick rounded back, and a
sharp inferior margin along the front that runs out into a thin tip. Its shape is a formula (below):
a closed rim curve joined to a top point and a bottom point, each join being round or sharp as a number
carried along the rim says. Gmsh meshes B-splines through it evenly and fills it. The cylinder is Gmsh's own.
Both are then smoothed against bad tetrahedra (the smallest one sets an explicit solver's time step),
numbered for locality, rounded, and written as Gmsh 2.2 ASCII in metres. One thread and fixed seeds: run
again on the same machine, it gives the same bytes. To run it:

    apt-get install -y libglu1-mesa libxrender1 libxcursor1 libxft2 libxinerama1 libgomp1
    python3 -m venv /tmp/v && /tmp/v/bin/pip install gmsh==4.15.2 numpy==2.4.6
    /tmp/v/bin/python tools/make_meshes.py [OUTPUT_DIR]
"""
import sys
from pathlib import Path

import gmsh
import numpy as np

GMSH_VERSION = "4.15.2"
MM = 1e-3

# Lobe. x: length, thick end at -x, tip at +x; y: front (margin) low, back high; z: up.
# Control points of the rim's closed cubic B-spline: x, y, z in mm, and the edge exponent there
# (1: a sharp edge; 0.5: as round as an ellipse).
LOBE_RIM = np.array([
    [96, 4, 17, 1.0], [72, -22, 11, 1.0], [44, -38, 5, 1.0], [25, -38, 4, 1.0], [4, -52, 1, 1.0],
    [-26, -58, -1, 1.0], [-52, -46, 2, 0.95], [-68, -16, 13, 0.7], [-64, 22, 23, 0.5], [-36, 43, 25, 0.5],
    [1, 45, 25, 0.5], [36, 34, 25, 0.5], [70, 26, 22, 0.75]])
# The two poles in mm, and how far each patch hangs below its meridians' plain curve, half way out, in mm
# where the rim is sharp and where it is round (negative: bulges above). The lower pole's height above
# the margin is the underside's hollow.
LOBE_TOP, LOBE_TOP_SAG = np.array([-11, 4, 61]), (-2.5, 0)
LOBE_BOTTOM, LOBE_BOTTOM_SAG = np.array([-11, 4, 20]), (1.5, 7)
LOBE_EDGE = 5.5  # mm, edge length asked of Gmsh

# Cylinder along z from z = 0; the edge length asked for at its surface, and on its axis as a share of that
# (an even size would give too many nodes for the wished 2373 tetrahedra). Lengths in mm.
CYL_RADIUS, CYL_LENGTH, CYL_EDGE, CYL_AXIS = 25.0, 150.0, 11.0, 0.6

ALTITUDE_WISH = 0.29  # of the mean edge; `improve` works on tetrahedra flatter than this

FACES = [[1, 2, 3], [0, 3, 2], [0, 1, 3], [0, 2, 1]]  # of a tetrahedron, outward


def lobe_rim(n):
    """n points (x, y, z, exponent) along the closed uniform cubic B-spline of LOBE_RIM."""
    k, t = np.divmod(np.arange(n) * len(LOBE_RIM) / n, 1.0)
    k, t = k.astype(int), t[:, None]
    w = [(1 - t)**3, 3 * t**3 - 6 * t**2 + 4, -3 * t**3 + 3 * t**2 + 3 * t + 1, t**3]
    return sum(w[j] / 6 * LOBE_RIM[(k + j - 1) % len(LOBE_RIM)] for j in range(4))


def lobe_z(s, rim, pole, sag):
    """Height at the fraction s of the way from the pole to the rim point `rim`."""
    rest = np.maximum(1 - s**2, 0)
    plain = rim[..., 2] + rest**rim[..., 3] * (pole[2] - rim[..., 2])
    return plain - np.interp(rim[..., 3], (0.5, 1), sag[::-1]) * 4 * s**2 * rest


def lobe_project(points, on_top, on_bottom):
    """Puts points (metres) back, along z, on the patch they belong to, or radially on the rim if on both."""
    rim, p = lobe_rim(4000), points / MM
    angle = np.arctan2(*(rim[:, :2] - LOBE_TOP[:2]).T[::-1])
    rim = rim[np.argsort(angle)]
    way = p[:, :2] - LOBE_TOP[:2]
    r = np.column_stack([np.interp(np.arctan2(way[:, 1], way[:, 0]), np.sort(angle), c, period=2 * np.pi)
                         for c in rim.T])
    if on_top and on_bottom:
        return r[:, :3] * MM
    s = np.linalg.norm(way, axis=1) / np.linalg.norm(r[:, :2] - LOBE_TOP[:2], axis=1)
    shape = (LOBE_TOP, LOBE_TOP_SAG) if on_top else (LOBE_BOTTOM, LOBE_BOTTOM_SAG)
    return np.column_stack([p[:, :2], lobe_z(s, r, *shape)]) * MM


def build_lobe(across=80, rings=24):
    """Two B-spline surfaces from the rim to the poles, their control points on the formula's shape."""
    occ = gmsh.model.occ
    rim = lobe_rim(across)
    rim_tags = [occ.addPoint(*p) for p in rim[:, :3] * MM]
    for pole, sag in ((LOBE_TOP, LOBE_TOP_SAG), (LOBE_BOTTOM, LOBE_BOTTOM_SAG)):
        rows = [rim_tags]
        for s in np.cos(np.pi / 2 * np.arange(1, rings) / rings):
            ring = np.c_[pole[:2] + s * (rim[:, :2] - pole[:2]), lobe_z(s, rim, pole, sag)]
            rows.append([occ.addPoint(*p) for p in ring * MM])
        rows.append([occ.addPoint(*pole * MM)] * across)
        occ.addBSplineSurface([tag for row in rows for tag in row + row[:1]], across + 1)
    occ.remove(occ.getEntities(0))
    occ.removeAllDuplicates()  # the two rims become one
    occ.addVolume([occ.addSurfaceLoop([1, 2], sewing=True)])
    occ.synchronize()
    gmsh.option.setNumber("Mesh.Algorithm", 6)
    for name in ("Mesh.MeshSizeMin", "Mesh.MeshSizeMax"):
        gmsh.option.setNumber(name, LOBE_EDGE * MM)


def build_cylinder():
    gmsh.model.occ.addCylinder(0, 0, 0, 0, 0, CYL_LENGTH * MM, CYL_RADIUS * MM)
    gmsh.model.occ.synchronize()
    size = gmsh.model.mesh.field.add("MathEval")
    gmsh.model.mesh.field.setString(
        size, "F", f"{CYL_EDGE * MM}*({CYL_AXIS}+{1 - CYL_AXIS}*(x^2+y^2)/{CYL_RADIUS * MM}^2)")
    gmsh.model.mesh.field.setAsBackgroundMesh(size)
    gmsh.option.setNumber("Mesh.Algorithm", 5)
    gmsh.option.setNumber("Mesh.MeshSizeExtendFromBoundary", 0)


def mesh_volume():
    """Fills the current model: points, tetrahedra, triangles by surface, all numbered from 0."""
    gmsh.model.mesh.generate(3)
    for method in ("", "Netgen", "Relocate3D", "Netgen", ""):
        gmsh.model.mesh.optimize(method)
    tags, xyz, _ = gmsh.model.mesh.getNodes()
    index = np.zeros(int(tags.max()) + 1, int)
    index[tags.astype(int)] = np.arange(len(tags))
    tets = index[gmsh.model.mesh.getElementsByType(4)[1].astype(int)].reshape(-1, 4)
    tris = {s: index[gmsh.model.mesh.getElementsByType(2, s)[1].astype(int)].reshape(-1, 3)
            for _, s in gmsh.model.getEntities(2)}
    return xyz.reshape(-1, 3), tets, tris


def mean_edge(x, tets):
    ends = tets[:, [[0, 1], [0, 2], [0, 3], [1, 2], [1, 3], [2, 3]]].reshape(-1, 2)
    ends = np.unique(np.sort(ends, 1), axis=0)
    return np.linalg.norm(x[ends[:, 0]] - x[ends[:, 1]], axis=1).mean()


def fitness(p, edge):
    """Smallest altitude of each tetrahedron p: (..., 4, 3), less in one with an edge longer than `edge`,
    negative in an inverted one."""
    a, b, c = (p[..., i, :] - p[..., 0, :] for i in (1, 2, 3))
    ab, bc, ca = np.cross(a, b), np.cross(b, c), np.cross(c, a)
    normals = np.stack([ab, bc, ca, ab + bc + ca], -2)
    altitude = (ab * c).sum(-1) / np.sqrt((normals**2).sum(-1).max(-1))
    longest = np.sqrt((np.stack([a, b, c, b - a, c - b, a - c], -2)**2).sum(-1).max(-1))
    return altitude * np.minimum(1, edge / longest)


def improve(x, tets, surfaces, project, sweeps=20):
    """Betters the tetrahedra whose fitness is below the wish: moves their corners (those on a surface along
    it, by `project`, or not at all) to the best of a fan of places, or drops an inner corner into a
    neighbour."""
    edge = mean_edge(x, tets)
    wish = ALTITUDE_WISH * edge
    rng = np.random.default_rng(1)
    home = {n: tuple(n in s for s in surfaces) for n in range(len(x))}
    tets = [tuple(t) for t in tets.tolist()]  # a dropped one becomes ()
    star = [set() for _ in x]
    for k, t in enumerate(tets):
        for n in t:
            star[n].add(k)
    for _ in range(sweeps):
        fan = rng.normal(size=(64, 3))
        fan *= wish * np.geomspace(0.02, 1, 64)[:, None] / np.linalg.norm(fan, axis=1)[:, None]
        live = [k for k, t in enumerate(tets) if t]
        fit = fitness(x[np.array([tets[k] for k in live])], edge)
        worst_first = [live[k] for k in np.argsort(fit, kind="stable") if fit[k] < wish]
        for n in dict.fromkeys(n for k in worst_first for n in tets[k]):
            t = np.array([tets[k] for k in sorted(star[n])]).reshape(-1, 4)
            now = fitness(x[t], edge).min(initial=wish)
            if now >= wish or (any(home[n]) and project is None):
                continue
            if not any(home[n]):
                merged = {}  # fitness after dropping n into a neighbour
                for m in np.unique(t[t != n]).tolist():
                    kept = t[~(t == m).any(1)]
                    merged[m] = fitness(x[np.where(kept == n, m, kept)], edge).min()
                into = max(merged, key=merged.get)
                if merged[into] > now:
                    for k in sorted(star[n]):
                        gone = into in tets[k]
                        for v in tets[k]:
                            star[v].discard(k)
                        tets[k] = () if gone else tuple(into if v == n else v for v in tets[k])
                        for v in tets[k]:
                            star[v].add(k)
                    continue
            places = project(x[n] + fan, *home[n]) if any(home[n]) else x[n] + fan
            p = np.repeat(x[t][None], len(places), 0)
            p[:, t == n] = places[:, None]
            fit = fitness(p, edge).min(1)
            if fit.max() > now:
                x[n] = places[fit.argmax()]
    return x, np.array([t for t in tets if t])


def renumber(x, tets, tris):
    """Nodes in reverse Cuthill-McKee order, unused ones left out; elements by their smallest nodes; each
    tetrahedron's corners by number, the last two swapped where its volume would be negative; triangles
    facing outward."""
    near = {n: set() for n in np.unique(tets).tolist()}
    for t in tets.tolist():
        for n in t:
            near[n].update(t)
    degree = {n: len(m) for n, m in near.items()}
    order = [min(near, key=lambda n: (x[n, 0], n))]  # a node at one end of x
    seen = set(order)
    for n in order:
        new = sorted(near[n] - seen, key=lambda m: (degree[m], m))
        order.extend(new)
        seen.update(new)
    order = np.array(order[::-1])
    index = np.full(len(x), -1)
    index[order] = np.arange(len(order))
    x, tets = x[order], np.sort(index[tets], 1)
    tets = tets[np.lexsort(tets.T[::-1])]
    flip = np.linalg.det(x[tets[:, 1:]] - x[tets[:, :1]]) < 0
    tets[flip] = tets[flip][:, [0, 1, 3, 2]]
    outward = {tuple(sorted(f)): f for f in tets[:, FACES].reshape(-1, 3).tolist()}
    tris = {s: sorted(map(tuple, np.sort(index[t], 1).tolist())) for s, t in tris.items()}
    return x, tets, {s: np.array([outward[t] for t in ts]) for s, ts in tris.items()}


def quality(x, tets):
    """Per tetrahedron: volume, smallest dihedral (degrees), radius ratio 3r/R, smallest altitude."""
    p = x[tets]
    spokes = p[:, 1:] - p[:, :1]
    vol = np.linalg.det(spokes) / 6
    corners = p[:, FACES]
    normal = np.cross(corners[:, :, 1] - corners[:, :, 0], corners[:, :, 2] - corners[:, :, 0])
    area = np.linalg.norm(normal, axis=2) / 2
    unit = normal / (2 * area[..., None])
    cos = -np.einsum("eik,ejk->eij", unit, unit)[:, *np.triu_indices(4, 1)]
    centre = np.linalg.solve(2 * spokes, (spokes**2).sum(2)[..., None])[..., 0]
    ratio = 9 * vol / area.sum(1) / np.linalg.norm(centre, axis=1)
    return vol, np.degrees(np.arccos(cos.max(1))), ratio, 3 * vol / area.max(1)


def write_msh(path, x, tets, tris, names):
    """Gmsh 2.2 ASCII; groups 1, 2, ... are the surfaces in turn, the last one is the tissue."""
    groups = [f'2 {s} "{names[s - 1]}"' for s in tris] + [f'3 {len(tris) + 1} "tissue"']
    rows = [f"2 2 {s} {s} " + " ".join(map(str, t)) for s in tris for t in tris[s] + 1]
    rows += [f"4 2 {len(tris) + 1} 1 " + " ".join(map(str, t)) for t in tets + 1]
    nodes = [" ".join(f"{c:.7f}" for c in p) for p in x]
    lines = ["$MeshFormat", "2.2 0 8", "$EndMeshFormat"]
    for title, body in (("PhysicalNames", groups), ("Nodes", nodes), ("Elements", rows)):
        if body is not groups:
            body = [f"{k} {row}" for k, row in enumerate(body, 1)]
        lines += [f"${title}", str(len(body)), *body, f"$End{title}"]
    path.write_text("\n".join(lines) + "\n", newline="\n")


def make(path, build, project, names):
    gmsh.initialize(interruptible=False)
    for option, value in {"General.NumThreads": 1, "General.Verbosity": 1, "Mesh.RandomSeed": 1}.items():
        gmsh.option.setNumber(option, value)
    build()
    x, tets, tris = mesh_volume()
    gmsh.finalize()
    x, tets = improve(x, tets, [set(t.ravel().tolist()) for t in tris.values()], project)
    x = np.round(x, 7) + 0.0  # what the file says; no -0
    x, tets, tris = renumber(x, tets, tris)
    write_msh(path, x, tets, tris, names)
    vol, dihedral, ratio, altitude = quality(x, tets)
    skin = np.sort(tets[:, FACES].reshape(-1, 3), 1)
    skin, count = np.unique(skin, axis=0, return_counts=True)
    given = np.unique(np.sort(np.vstack(list(tris.values())), 1), axis=0)
    assert vol.min() > 0 and np.array_equal(np.unique(tets), np.arange(len(x)))
    assert count.max() == 2 and np.array_equal(skin[count == 1], given)
    low, high = x.min(0) / MM, x.max(0) / MM
    print(f"{path}: {len(x)} nodes, {len(tets)} tetrahedra, {len(given)} triangles, "
          f"{path.stat().st_size / 1000:.0f} kB\n"
          f"  box (mm) {low.round(1)} to {high.round(1)}, volume {vol.sum() * 1e6:.1f} cm3, "
          f"bandwidth {(tets.max(1) - tets.min(1)).max()}\n"
          f"  dihedral (deg) min {dihedral.min():.1f}, 1 % {np.percentile(dihedral, 1):.1f}, "
          f"median of smallest {np.median(dihedral):.1f}\n"
          f"  radius ratio min {ratio.min():.2f}, median {np.median(ratio):.2f}\n"
          f"  altitude (mm) min {altitude.min() / MM:.2f}, median {np.median(altitude) / MM:.2f}, "
          f"mean edge {mean_edge(x, tets) / MM:.2f}")


if __name__ == "__main__":
    if gmsh.__version__ != GMSH_VERSION:
        print(f"warning: gmsh {gmsh.__version__} where {GMSH_VERSION} made the kept files", file=sys.stderr)
    out = Path(sys.argv[1] if len(sys.argv) > 1 else Path(__file__).resolve().parent.parent / "meshes")
    out.mkdir(parents=True, exist_ok=True)
    make(out / "lobe.msh", build_lobe, lobe_project, ("diaphragmatic", "visceral"))
    make(out / "cylinder.msh", build_cylinder, None, ("side", "top", "bottom"))
