"""Tetrahedra of a segmented organ: from a label map (NIfTI, NRRD, MetaImage) or a closed surface (STL, PLY, OBJ), as a Gmsh file in mm.

    python3 examples/organ_mesh.py LABELS.nii.gz --label 1 --edge 6 --out organ.msh
    python3 examples/organ_mesh.py SURFACE.stl --edge 6 --out organ.msh

A label map becomes a surface by marching cubes over the smoothed label, in the scanner's coordinates (LPS, mm); fTetWild (Hu et al. 2020)
fills it with tetrahedra of about the edge length that is asked for, whatever the surface is like. Needs numpy, SimpleITK, scikit-image,
pytetwild with pyvista, and meshio: `pip install -r tools/organ.txt`. It prints the volume of the mesh over that of the voxels, which tells lost parts.
"""

import argparse
import os
import pathlib
import sys
import tempfile

import meshio
import numpy as np

MAPS = (".nii", ".nii.gz", ".nrrd", ".nhdr", ".mha", ".mhd")


def stop(message):
    print(f"error: {message}", file=sys.stderr)
    sys.exit(2)


def surface_of_label(path, label):
    """Vertices (mm), triangles, and the volume of the voxels, mm^3."""
    import SimpleITK as sitk
    from skimage.measure import marching_cubes

    image = sitk.ReadImage(str(path))
    if image.GetDimension() != 3:
        stop(f"{path}: it has {image.GetDimension()} dimensions, a label map has 3")
    here = image == label
    count = int(sitk.GetArrayViewFromImage(here).sum())
    if count == 0:
        known = np.unique(sitk.GetArrayViewFromImage(image))
        stop(f"{path}: no voxel has the label {label}; there are {', '.join(str(each) for each in known[:20])}")
    # The organ's box of a large scan. Labels that reach the end of the image are closed there.
    shape = sitk.LabelShapeStatisticsImageFilter()
    shape.Execute(here)
    box = shape.GetBoundingBox(1)
    here = sitk.ConstantPad(sitk.RegionOfInterest(here, box[3:], box[:3]), [3] * 3, [3] * 3, 0)
    spacing = np.array(here.GetSpacing())
    smooth = sitk.SmoothingRecursiveGaussian(sitk.Cast(here, sitk.sitkFloat32), float(spacing.max()))
    values = sitk.GetArrayFromImage(smooth).transpose(2, 1, 0)
    vertices, triangles, _, _ = marching_cubes(values, 0.5)
    direction = np.array(here.GetDirection()).reshape(3, 3)
    points = (vertices * spacing) @ direction.T + np.array(here.GetOrigin())
    return points, triangles, count * spacing.prod()


def surface_of_file(path):
    mesh = meshio.read(path)
    triangles = mesh.cells_dict.get("triangle")
    if triangles is None or len(triangles) == 0:
        stop(f"{path}: it holds no triangles")
    return mesh.points, triangles, None


def volumes(points, tetrahedra):
    a, b, c, d = (points[tetrahedra[:, corner]] for corner in range(4))
    return np.einsum("ij,ij->i", np.cross(b - a, c - a), d - a) / 6.0


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("input", type=pathlib.Path)
    parser.add_argument("--label", type=int, default=1, help="of the organ, in a label map")
    parser.add_argument("--edge", type=float, required=True, help="length of edges, mm")
    parser.add_argument("--out", type=pathlib.Path, required=True)
    asked = parser.parse_args()
    if not asked.input.exists():
        stop(f"{asked.input}: there is no such file")
    if not asked.out.resolve().parent.is_dir():
        stop(f"{asked.out}: there is no such folder")
    if not (np.isfinite(asked.edge) and asked.edge > 0.0):
        stop(f"--edge {asked.edge}: it must be a positive number of mm")
    if asked.input.name.endswith(MAPS):
        points, triangles, voxels = surface_of_label(asked.input, asked.label)
    else:
        points, triangles, voxels = surface_of_file(asked.input)
    size = np.ptp(points, axis=0)
    print(f"surface  {len(points)} vertices, {len(triangles)} triangles, {size.round(1)} mm")
    if asked.edge > 0.5 * size.min():
        stop(f"--edge {asked.edge}: the organ is only {size.min():.1f} mm thick")

    import pytetwild

    # The surface may move by a tenth of an edge.
    epsilon = 0.1 * asked.edge / np.linalg.norm(size)
    out = asked.out.resolve()
    with tempfile.TemporaryDirectory() as folder:
        os.chdir(folder)  # it leaves a file
        points, tetrahedra = pytetwild.tetrahedralize(
            points.astype(np.float64), triangles.astype(np.int32), edge_length_abs=asked.edge, epsilon=epsilon, num_threads=1
        )
        os.chdir(out.parent)
    used, tetrahedra = np.unique(tetrahedra, return_inverse=True)
    points, tetrahedra = points[used], tetrahedra.reshape(-1, 4)
    signed = volumes(points, tetrahedra)
    tetrahedra[signed < 0.0] = tetrahedra[signed < 0.0][:, [0, 2, 1, 3]]
    whole = np.abs(signed).sum()
    edges = np.concatenate([points[tetrahedra[:, a]] - points[tetrahedra[:, b]] for a in range(4) for b in range(a)])
    print(f"mesh     {len(points)} nodes, {len(tetrahedra)} tetrahedra, mean edge {np.linalg.norm(edges, axis=1).mean():.1f} mm")
    share = "" if voxels is None else f", {100.0 * whole / voxels:.1f} % of that of the voxels"
    print(f"volume   {whole / 1e3:.1f} cm^3{share}")
    tags = [np.ones(len(tetrahedra), dtype=np.int32)]
    cells = meshio.Mesh(points, [("tetra", tetrahedra)], cell_data={"gmsh:physical": tags, "gmsh:geometrical": tags})
    meshio.write(out, cells, file_format="gmsh22", binary=False)
    print(f"written  {asked.out} (mm: scale = 0.001 in a scene file)")


main()
