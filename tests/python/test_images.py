"""Points that follow, displacement fields and warped images, held against closed forms and SimpleITK's own inversion and resampling."""

import json
import subprocess
import sys
import warnings

import numpy as np
import pytest
import SimpleITK as sitk
import supple
from conftest import bar

GRAVITY = np.array([3.0, 0.0, -9.81])
# Turned by 20 degrees around z, and upside down along x.
TURN = np.array([[-0.9396926, -0.3420201, 0.0], [-0.3420201, 0.9396926, 0.0], [0.0, 0.0, 1.0]])


@pytest.fixture(scope="module")
def sagged(lobe):
    """The lobe under gravity, moved by up to 21 mm."""
    liver = supple.Material("exponential", a=6000.0, b=8.023, d=160000.0, density=1060.0)
    simulation = supple.Simulation(supple.Scene(lobe, liver, fixed=lobe.points[:, 1] > 0.03, element="nodal-pressure"), damping=20.0, gravity=GRAVITY)
    simulation.advance(1.0)
    return simulation


def grid_around(simulation, spacing, margin=15.0):
    both = 1e3 * np.concatenate([simulation.scene.mesh.points, simulation.positions])
    low, high = both.min(axis=0) - margin, both.max(axis=0) + margin
    return supple.Grid(tuple(low), (spacing,) * 3, tuple(int(n) + 2 for n in (high - low) / spacing))


def image_of(grid, values):
    made = sitk.GetImageFromArray(values)
    made.SetOrigin([float(each) for each in grid.origin])
    made.SetSpacing([float(each) for each in grid.spacing])
    made.SetDirection(np.ravel(grid.direction).tolist())
    return made


def inside_points(simulation, count=3000):
    mesh = simulation.scene.mesh
    places = np.random.default_rng(49).uniform(mesh.points.min(axis=0), mesh.points.max(axis=0), (4 * count, 3))
    located = simulation.locate(places)
    return simulation.locate(places[located.distances == 0.0][:count])


def test_points_follow_their_elements(sagged):
    mesh = sagged.scene.mesh
    nodes = sagged.locate(mesh.points)
    assert not nodes.distances.any() and len(nodes) == len(mesh.points)
    assert abs(nodes.positions - sagged.positions).max() < 1e-7 and abs(nodes.velocities - sagged.velocities).max() < 1e-5
    within = inside_points(sagged)
    corners = mesh.tets[within.elements]
    for values, of_nodes in ((within.rest, mesh.points), (within.positions, sagged.positions), (within.displacements, sagged.displacements)):
        assert abs(np.einsum("nk,nka->na", within.weights, of_nodes[corners]) - values).max() < 1e-7
    assert within.weights.min() >= 0.0 and within.weights.sum(axis=1) == pytest.approx(1.0, abs=1e-6)
    assert not within.distances.flags.writeable


def test_points_outside_follow_the_nearest_point(soft):
    simulation = supple.Simulation(supple.Scene(bar(), soft, fixed=[0]), gravity=(0.0, 0.0, -9.81))
    outside = simulation.locate([[0.025, 0.01, 0.03], [0.01, 0.01, 0.03], [0.01, -0.02, -0.03]])
    assert outside.distances == pytest.approx([0.005, 0.0, np.hypot(0.02, 0.03)], abs=1e-8)
    simulation.advance(0.02)
    near = simulation.locate([[0.02, 0.01, 0.03]])
    assert outside.displacements[0] == pytest.approx(near.displacements[0], abs=1e-7)
    assert "2 of them outside" in repr(outside)


def test_points_that_cannot_be_are_refused_in_words(sagged):
    with pytest.raises(supple.InputError, match=r"points: row 1 is \[nan, 0.0, 0.0\], not finite"):
        sagged.locate([[0.0, 0.0, 0.0], [np.nan, 0.0, 0.0]])
    with pytest.raises(supple.InputError, match=r"points: its shape is \(3,\), it must be \(n, 3\)"):
        sagged.locate([0.0, 0.0, 0.0])
    assert sagged.locate(np.zeros((0, 3))).positions.shape == (0, 3)


@pytest.mark.parametrize(("spacing", "most"), [(2.0, 0.05), (1.0, 0.02)])
def test_there_and_back(sagged, spacing, most):
    """ITK's transforms of both fields carry points of the tissue to where they are now, and back."""
    points, grid = inside_points(sagged), grid_around(sagged, spacing)
    rest, now = 1e3 * points.rest.astype(float), 1e3 * points.positions.astype(float)
    forward, inverse = (sagged.field(grid, kind).transform() for kind in ("forward", "inverse"))
    carried = np.array([forward.TransformPoint(place) for place in rest.tolist()])
    back = np.array([inverse.TransformPoint(place) for place in now.tolist()])
    both = np.array([inverse.TransformPoint(place) for place in carried.tolist()])
    for name, off in (("forward", carried - now), ("inverse", back - rest), ("there and back", both - rest)):
        off = np.linalg.norm(off, axis=1)
        print(f"{spacing} mm, {name}: mean {off.mean():.4f} mm, 95 % {np.percentile(off, 95):.4f}, largest {off.max():.4f}")
        assert np.percentile(off, 95) < most and off.mean() < 0.2 * spacing * most + 0.01 and off.max() < 0.2 * spacing


def test_the_inverse_is_that_of_simple_itk(sagged):
    """Within the tissue, whose points are known from the mesh as it is now."""
    grid = grid_around(sagged, 2.0)
    ours, forward = sagged.field(grid, "inverse"), sagged.field(grid, "forward")
    theirs = sitk.InvertDisplacementField(
        forward.image(), maximumNumberOfIterations=50, meanErrorToleranceThreshold=1e-4, maxErrorToleranceThreshold=1e-3,
        enforceBoundaryCondition=False,
    )  # fmt: skip
    now = supple.Simulation(supple.Scene(supple.Mesh(sagged.positions, sagged.scene.mesh.tets), sagged.scene.material))
    inside = now.locate(1e-3 * grid.points().reshape(-1, 3)).distances.reshape(ours.values.shape[:3]) == 0.0
    deep = sitk.GetArrayFromImage(sitk.BinaryErode(sitk.GetImageFromArray(inside.astype(np.uint8)), [1, 1, 1])) == 1
    lengths = np.linalg.norm(sitk.GetArrayFromImage(theirs) - ours.values, axis=-1)
    for name, off in (("inside", lengths[inside]), ("deeper than a point", lengths[deep])):
        print(f"{off.size} points {name}: mean {off.mean():.4f} mm, 99 % {np.percentile(off, 99):.4f}, largest {off.max():.4f}")
    assert abs(int(inside.sum()) - ours.inside) <= 3
    assert lengths[inside].mean() < 0.01 and np.percentile(lengths[deep], 99.9) < 0.1


def test_a_field_goes_on_within_bounds_and_does_not_fold(sagged):
    for kind in ("inverse", "forward"):
        field = sagged.field(grid_around(sagged, 2.0), kind)
        least, most = (1e3 * edge(sagged.displacements, axis=0) for edge in (np.min, np.max))
        if kind == "inverse":
            least, most = -most, -least
        assert (field.values >= least - 1e-4).all() and (field.values <= most + 1e-4).all()
        volumes = sitk.GetArrayFromImage(sitk.DisplacementFieldJacobianDeterminant(field.image()))[1:-1, 1:-1, 1:-1]
        print(f"{kind}: volume ratios {volumes.min():.2f} to {volumes.max():.2f}")
        assert volumes.min() > 0.1


def test_a_reach_ends_the_field(sagged):
    grid = grid_around(sagged, 3.0, margin=60.0)
    field = sagged.field(grid, "forward", reach=45.0)
    distance = supple.points._located(sagged.scene.mesh, 1e-3 * grid.points().reshape(-1, 3))["distance"].reshape(field.values.shape[:3])
    lengths = np.linalg.norm(field.values, axis=-1)
    assert lengths[distance > 0.065].max() == 0.0 and lengths[(distance > 0.0) & (distance < 0.003)].max() > 10.0
    with pytest.warns(RuntimeWarning, match="reach 20 mm: the field may fold where it falls off, since nodes move by up to 2"):
        sagged.field(grid, reach=20.0)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        sagged.field(grid, reach=45.0)


def test_an_oblique_image_is_warped_as_simple_itk_has_it(soft):
    """A bar that falls: the image shifted by so much, also where directions are turned, and with a mesh in RAS axes."""
    mesh = bar()
    simulation = supple.Simulation(supple.Scene(mesh, soft), step=2e-4, gravity=(2.0, 4.0, -9.81))
    simulation.advance(0.06)
    shift = 1e3 * simulation.displacements.mean(axis=0).astype(float)
    grid = supple.Grid((45.0, -20.0, -30.0), (0.9, 1.1, 1.6), (70, 60, 70), tuple(map(tuple, TURN)))
    for axes, signs in (("LPS", [1.0, 1.0, 1.0]), ("RAS", [-1.0, -1.0, 1.0])):
        here = supple.Grid(tuple(np.array(signs) * grid.origin), grid.spacing, grid.size, tuple(map(tuple, np.array(signs)[:, None] * TURN)))
        image = image_of(here, np.random.default_rng(3).normal(size=(70, 60, 70)).astype(np.float32))
        image = sitk.SmoothingRecursiveGaussian(image, 3.0)
        moved = sitk.TranslationTransform(3, (-np.array(signs) * shift).tolist())
        expected = sitk.GetArrayFromImage(sitk.Resample(image, image, moved, sitk.sitkLinear, 0.0))
        field = simulation.field(image, axes=axes)
        got = sitk.GetArrayFromImage(field.warp(image))
        inner = (slice(12, -12),) * 3
        assert field.inside > 5000 and abs(got - expected)[inner].max() < 1e-3 * np.ptp(expected)
        assert field.values.reshape(-1, 3) == pytest.approx(np.broadcast_to(-np.array(signs) * shift, (70 * 60 * 70, 3)), abs=0.02)


def test_a_tumour_in_an_image_goes_where_its_points_go(sagged, tmp_path):
    """A ball of label 7 in the lobe: its centre in the warped map is where its points are; files of both formats carry the same."""
    grid = grid_around(sagged, 1.5)
    centre, radius = np.array([0.02, -0.02, 0.03]), 0.008
    is_ball = np.linalg.norm(1e-3 * grid.points() - centre, axis=-1) < radius
    labels = image_of(grid, np.where(is_ball, 7, 0).astype(np.uint8))
    followed = sagged.locate(1e-3 * grid.points()[is_ball])
    assert not followed.distances.any() and np.linalg.norm(followed.displacements, axis=1).mean() > 3e-3
    field = sagged.field(labels)
    warped = sitk.GetArrayFromImage(field.warp(labels, labels=True))
    assert set(np.unique(warped)) == {0, 7} and warped.dtype == np.uint8
    off = np.linalg.norm(grid.points()[warped == 7].mean(axis=0) - 1e3 * followed.positions.mean(axis=0))
    print(f"the middle of {np.count_nonzero(warped)} voxels is {off:.3f} mm from that of its points")
    assert off < 0.25
    point = (1e3 * followed.positions[0]).tolist()
    expected = field.transform().TransformPoint(point)
    for name in ("field.h5", "field.tfm", "field.nrrd", "field.mha", "field.nii.gz"):
        field.write(tmp_path / name)
        if name.endswith((".h5", ".tfm")):
            read = sitk.ReadTransform(str(tmp_path / name))
        else:
            read = sitk.DisplacementFieldTransform(sitk.ReadImage(str(tmp_path / name), sitk.sitkVectorFloat64))
        assert read.TransformPoint(point) == pytest.approx(expected, abs=1e-3), name
    with pytest.raises(supple.InputError, match="field.png: a transform ends in .h5"):
        field.write(tmp_path / "field.png")
    with pytest.raises(supple.InputError, match="an image is warped with an inverse field"):
        sagged.field(labels, "forward").warp(labels)


def test_grids_that_cannot_be_are_refused_in_words(sagged):
    good = grid_around(sagged, 5.0)
    for change, words in [
        ({"spacing": (1.0, 0.0, 1.0)}, r"the grid: spacing \(1.0, 0.0, 1.0\): they must be three positive numbers, mm"),
        ({"spacing": 2.0}, "the grid: spacing 2.0: "),
        ({"origin": (np.nan, 0.0, 0.0)}, r"the grid: origin \(nan, 0.0, 0.0\): they must be three finite numbers, mm"),
        ({"direction": ((1.0, 0.2, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0))}, r"the grid: direction \(\(1.0, 0.2, .*: resample the image"),
        ({"size": (0, 5, 5)}, r"the grid: size \(0, 5, 5\): whole numbers of points are needed, at least 1"),
        ({"size": (5.5, 5, 5)}, "whole numbers of points are needed"),
        ({"origin": (1000.0, 0.0, 0.0)}, r"no point of the grid is within the tissue, which lies from .* mm \(LPS\): is the mesh in metres"),
    ]:
        grid = supple.Grid(**{"origin": good.origin, "spacing": good.spacing, "size": good.size, **change})
        with pytest.raises(supple.InputError, match=words):
            sagged.field(grid)
    for asked, words in [
        ({"kind": "backward"}, "kind 'backward': there are forward, inverse"),
        ({"axes": "LAS"}, "axes 'LAS': there are LPS, RAS"),
        ({"reach": -1.0}, "reach -1.0: it must be zero or a positive number, mm"),
        ({"reach": "5"}, "reach '5': it must be a number"),
        ({"axes": 1}, "axes 1: there are LPS, RAS"),
    ]:
        with pytest.raises(supple.InputError, match=words):
            sagged.field(good, **asked)
    with pytest.raises(supple.InputError, match="an image of SimpleITK or a supple.Grid is needed, not str"):
        sagged.field("CT.nii.gz")
    with pytest.raises(supple.InputError, match="the image has 2 dimensions, 3 are needed"):
        sagged.field(sitk.Image(5, 5, sitk.sitkFloat32))


def run_of(simulation, folder):
    """A folder as `supple simulate` writes it: frames of the mesh at rest, and a table of the last displacements."""
    folder.mkdir()
    mesh = simulation.scene.mesh
    mesh.write(folder / "frame_0000.vtu")
    lines = ["node,x,y,z,ux,uy,uz"]
    for node, (point, moved) in enumerate(zip(mesh.points, simulation.displacements)):
        lines.append(",".join(str(number) for number in (node, *point, *moved)))
    (folder / "final.csv").write_text("\n".join(lines) + "\n")
    (folder / "summary.json").write_text(json.dumps({"status": "ok", "settled": None}))
    return folder


def test_the_command_warps_an_image(sagged, tmp_path):
    grid = grid_around(sagged, 2.0)
    image = sitk.SmoothingRecursiveGaussian(image_of(grid, np.random.default_rng(5).normal(size=grid.size[::-1]).astype(np.float32)), 4.0)
    run, files = run_of(sagged, tmp_path / "run"), [str(tmp_path / name) for name in ("CT.nii.gz", "warped.nii.gz", "field.h5")]
    sitk.WriteImage(image, files[0])

    def command(*given):
        return subprocess.run([sys.executable, "-m", "supple", "warp", *given], capture_output=True, text=True, cwd=tmp_path)

    done = command(str(run), "--image", files[0], "--out", files[1], "--field", files[2])
    assert done.returncode == 0 and done.stderr == "" and "within the tissue, which moved by up to 2" in done.stdout, done.stderr
    read = sitk.ReadImage(files[0])
    expected = sitk.Resample(read, read, sitk.ReadTransform(files[2]), sitk.sitkLinear, float(sitk.GetArrayViewFromImage(read).min()))
    warped = sitk.GetArrayFromImage(sitk.ReadImage(files[1]))
    assert abs(warped - sitk.GetArrayFromImage(expected)).max() < 1e-5
    assert abs(warped - sitk.GetArrayFromImage(sagged.field(read).warp(read))).max() < 1e-4 * np.ptp(warped)
    short = command(str(run), "--image", files[0], "--out", str(tmp_path / "labels.mha"), "--labels", "--reach", "20")
    assert short.returncode == 0 and short.stderr.startswith("warning: reach 20 mm: the field may fold"), short.stderr
    for told, words in [({"status": "inexact", "settled": None}, "the status is inexact"), ({"status": "ok", "settled": {"at_rest": False}}, "did not come to rest")]:
        (run / "summary.json").write_text(json.dumps(told))
        doubted = command(str(run), "--image", files[0], "--out", files[1])
        assert doubted.returncode == 0 and doubted.stderr.startswith("warning: ") and words in doubted.stderr, doubted.stderr
    (run / "summary.json").write_text(json.dumps({"status": "diverged", "settled": None}))
    diverged = command(str(run), "--image", files[0], "--out", files[1])
    assert diverged.returncode == 2 and "the run diverged" in diverged.stderr, diverged.stderr
    (run / "summary.json").write_text(json.dumps({"status": "ok", "settled": None}))
    for given, words in [
        ((str(tmp_path), "--image", files[0], "--out", files[1]), "give a folder that `supple simulate --out` has written"),
        ((str(run), "--image", str(tmp_path / "none.mha"), "--out", files[1]), "none.mha: there is no such file"),
        ((str(run), "--image", str(run / "final.csv"), "--out", files[1]), "final.csv: SimpleITK cannot read it: "),
        ((str(run), "--image", files[0], "--out", str(tmp_path / "no" / "x.mha")), "SimpleITK cannot write it: "),
    ]:
        refused = command(*given)
        assert refused.returncode == 2 and refused.stderr.startswith("error: ") and words in refused.stderr, refused.stderr


def test_tissue_that_moves_across_the_border_of_an_image_is_told(sagged, tmp_path):
    """One slice of labels, 1 mm thick, of a lobe that sags by up to 21 mm: what moves out of it is counted, point by point."""
    run, places = run_of(sagged, tmp_path / "run"), 1e3 * (sagged.scene.mesh.points + sagged.displacements)
    low, high, middle = places.min(axis=0), places.max(axis=0), np.median(places, axis=0)
    size = (*(int(each) + 1 for each in (high - low)[:2]), 1)
    grid = supple.Grid((float(low[0]), float(low[1]), float(middle[2])), (1.0, 1.0, 1.0), size)
    files = [str(tmp_path / name) for name in ("slice.nrrd", "warped.nrrd")]
    sitk.WriteImage(image_of(grid, np.ones(size[::-1], np.uint8)), files[0])
    asked = [sys.executable, "-m", "supple", "warp", str(run), "--image", files[0], "--out", files[1], "--labels"]
    done = subprocess.run(asked, capture_output=True, text=True, cwd=tmp_path)
    field = sagged.field(grid)
    sources = grid.points() + field.values
    from_outside = (sagged.locate(1e-3 * sources.reshape(-1, 3)).distances == 0.0) & (abs(field.values[..., 2]) > 0.5).ravel()
    assert 0 < from_outside.sum() <= field.inside
    words = f"warning: {from_outside.sum()} of the {field.inside} points within the tissue show what was outside the image, and have the label 0: "
    assert done.returncode == 0 and done.stderr.startswith(words) and done.stderr.count("warning") == 1, done.stderr
    with pytest.warns(RuntimeWarning, match=words[9:]):
        field.warp(sitk.ReadImage(files[0]), labels=True)
    # At least so many labels are gone.
    assert (sitk.GetArrayFromImage(sitk.ReadImage(files[1])) == 0).sum() >= from_outside.sum()


def test_displacements_in_millimetres_are_called_so(sagged):
    mesh, moved = sagged.scene.mesh, 1e3 * sagged.displacements
    grid = supple.Grid(tuple(1e3 * mesh.points.min(axis=0).astype(float)), (4.0, 4.0, 4.0), (30, 30, 30))
    words = "displacements are up to .* m, the tissue is .* m across: are they in metres"
    with pytest.warns(RuntimeWarning, match=words):
        supple.displacement_field(mesh, moved, grid)
    with pytest.raises(supple.InputError, match=f"no point of the grid is within the tissue as it has moved: {words}"):
        supple.displacement_field(mesh, np.full_like(moved, 5.0), grid)


def test_an_image_that_goes_on_beyond_the_field_is_warned_of():
    """A field of the lower half of a body that moves by 10 mm, and an image of all of it: above the field nothing would move."""
    mesh = supple.Mesh.box((0.04, 0.04, 0.08), (4, 4, 8))
    moved = np.tile([0.010, 0.0, 0.0], (len(mesh.points), 1))
    whole, half = (supple.Grid((0.5, 0.5, 0.5), (1.0, 1.0, 1.0), (60, 40, count)) for count in (80, 40))
    image = image_of(whole, np.zeros((80, 40, 60), np.float32))
    words = "the image goes on 40 mm beyond the grid of the field, at whose border it moves by 10 mm: .*; make the field on the grid of the image"
    with pytest.warns(RuntimeWarning, match=words):
        supple.displacement_field(mesh, moved, half).warp(image)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        supple.displacement_field(mesh, moved, whole).warp(image)
        supple.displacement_field(mesh, moved, whole.coarser(3)).warp(image)
        # Where the field has ended, nothing is lost.
        around = supple.Grid((-40.0, -40.0, -40.0), (2.0, 2.0, 2.0), (60, 60, 81))
        wide = supple.Grid((-80.0, -80.0, -80.0), (4.0, 4.0, 4.0), (50, 50, 60))
        supple.displacement_field(mesh, moved, around, reach=25.0).warp(image_of(wide, np.zeros((60, 50, 50), np.float32)))


def test_complex_images_are_refused_in_words(sagged):
    grid = grid_around(sagged, 4.0)
    real = image_of(grid, np.zeros(grid.size[::-1], np.float32))
    with pytest.raises(supple.InputError, match="complex values, which have no order: warp its real and its imaginary part"):
        sagged.field(real).warp(sitk.RealAndImaginaryToComplex(real, real))


def test_a_large_image_has_a_coarser_field():
    grid = supple.Grid((0.0, 0.0, 0.0), (0.7, 0.7, 1.0), (512, 512, 300))
    coarse = supple.images.grid_for_warping(grid)
    assert coarse.spacing == (1.4, 1.4, 2.0) and coarse.size == (257, 257, 151)
    for axis in range(3):
        assert coarse.spacing[axis] * (coarse.size[axis] - 1) >= grid.spacing[axis] * (grid.size[axis] - 1)
    assert supple.images.grid_for_warping(coarse) == coarse
