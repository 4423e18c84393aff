"""Where the shape itself is known, it is what is felt: fillets and rims included, whatever the mesh."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest
import trimesh

from palpate.mechanics.compliance.sites import principal_curvatures, touch_sites
from palpate.mechanics.contact.dent import dent_law, ellipse_curvature
from palpate.mechanics.contact.edges import edge_law
from palpate.mechanics.frames import local_frames, unit_vectors
from palpate.mechanics.model.files import read_model, write_model
from palpate.mechanics.model.model import Model
from palpate.mechanics.shape.nearest import neighbours, sample
from palpate.mechanics.shape.refine import refined_near_surface
from palpate.mechanics.shape.tetmesh import TetMesh
from palpate.mechanics.shape.true_shape import TrueShape
from palpate.render.fem.fine_surface import FineSurface
from palpate.render.options import RenderOptions
from palpate.render.registry import create
from palpate.render.surface.contact_surface import contact_surface
from palpate.render.surface.snapping import touched_surface

from . import shapes

RADIUS, HEIGHT, FILLET = 0.040, 0.050, 0.012
TIP = 0.005


def turned_on_a_lathe(profile: np.ndarray, around: int = 140) -> TrueShape:
    """The file of a body of revolution: chords of its profile (k, 2) of radius and height, base first."""
    angle = 2 * np.pi * np.arange(around) / around
    rim = np.stack([np.cos(angle), np.sin(angle)], axis=1)
    rings = [np.column_stack([r * rim, np.full(around, z)]) for r, z in profile]
    i, j, k = np.arange(around), (np.arange(around) + 1) % around, len(rings)
    faces = [np.column_stack([np.full(around, k * around), j, i])]
    for a, b in ((around * n, around * (n + 1)) for n in range(k - 1)):
        faces += [np.column_stack([a + i, a + j, b + j]), np.column_stack([a + i, b + j, b + i])]
    faces.append(
        np.column_stack([(k - 1) * around + i, (k - 1) * around + j, np.full(around, k * around + 1)])
    )
    ends = [[0, 0, profile[0, 1]], [0, 0, profile[-1, 1]]]
    return TrueShape(np.vstack([*rings, ends]), np.vstack(faces))


def filleted() -> TrueShape:
    turn = np.linspace(0, np.pi / 2, 12)
    fillet = np.column_stack([np.cos(turn), np.sin(turn)]) * FILLET + [RADIUS - FILLET, HEIGHT - FILLET]
    return turned_on_a_lathe(np.vstack([[RADIUS, 0.0], fillet]))


def off_filleted(p: np.ndarray) -> np.ndarray:
    """(k,) m, signed distance of points from the true body above its base."""
    q = np.column_stack([np.hypot(p[:, 0], p[:, 1]) - RADIUS, p[:, 2] - HEIGHT]) + FILLET
    return np.hypot(*np.maximum(q, 0).T) + np.minimum(q.max(axis=1), 0) - FILLET


def meshed(shape: TrueShape, cells: tuple[int, int]) -> TetMesh:
    """A coarse mesh of it, its surface nodes on the file's facets."""
    mesh = shapes.cylinder(RADIUS, HEIGHT, cells, order=1)
    points = mesh.points.copy()
    on = mesh.touchable & ~mesh.fixed
    points[on] = shape.foot(points[on])[0]
    return TetMesh(points, mesh.tetrahedra, mesh.fixed, mesh.touchable, shape)


@pytest.mark.parametrize("cells", [(6, 5), pytest.param((9, 7), marks=pytest.mark.release)])
def test_the_felt_surface_is_the_shape_on_its_fillets(cells):
    mesh = meshed(filleted(), cells)
    arrays = contact_surface(mesh).arrays
    felt = sample(arrays.vertices, arrays.triangles[arrays.free > 0], 20_000)
    felt = felt[felt[:, 2] > 3e-3]
    assert np.abs(off_filleted(felt)).max() < 1.5e-5
    # of the mesh alone it is an order of magnitude off
    alone = contact_surface(dataclasses.replace(mesh, shape=None)).arrays
    assert np.abs(off_filleted(alone.vertices[alone.vertices[:, 2] > 3e-3])).max() > 2e-4


def test_a_sharp_rim_stays_where_it_is_and_only_beside_it_the_normal_turns():
    shape = turned_on_a_lathe(np.array([[RADIUS, 0.0], [RADIUS, HEIGHT]]))
    for cells in ((6, 5), (9, 7)):
        arrays = contact_surface(meshed(shape, cells)).arrays
        assert (neighbours(arrays.triangles) >= 0).all()
        felt = sample(arrays.vertices, arrays.triangles[arrays.free > 0], 20_000)
        felt = felt[felt[:, 2] > 3e-3]
        off = np.maximum(np.hypot(felt[:, 0], felt[:, 1]) - RADIUS, felt[:, 2] - HEIGHT)
        assert np.abs(off).max() < 5e-5  # the chords of the rim itself; 2e-5 of the faces
        used = np.unique(arrays.triangles[arrays.free > 0])
        v, n = arrays.vertices[used], arrays.normals[used]
        inwards = RADIUS - np.hypot(v[:, 0], v[:, 1])
        top = np.abs(v[:, 2] - HEIGHT) < 1e-6
        assert n[top & (inwards > 2.05e-3), 2].min() > 1 - 1e-9
        rim = top & (inwards < 1e-5)
        assert n[rim, 2] == pytest.approx(np.full(rim.sum(), np.sqrt(0.5)), abs=0.03)


def test_beside_a_rim_a_small_tip_feels_the_face_and_not_the_rim():
    """The normal turned over 2 mm whatever the tip: 0.7 mm beside a rim 1 mm felt half of the force."""
    shape = turned_on_a_lathe(np.array([[RADIUS, 0.0], [RADIUS, HEIGHT]]))
    model = shapes.model(meshed(shape, (9, 7)))
    straight = []
    for tip in (0.005, 0.001):
        made = dataclasses.replace(model, tool=dataclasses.replace(model.tool, tip_radius_m=tip))
        arrays = touched_surface(made, RenderOptions()).arrays
        used = np.unique(arrays.triangles[arrays.free > 0])
        v, n = arrays.vertices[used], arrays.normals[used]
        top = np.abs(v[:, 2] - HEIGHT) < 1e-6
        turned = top & (n[:, 2] < 1 - 1e-6)
        straight.append((RADIUS - np.hypot(v[turned, 0], v[turned, 1])).max())
    assert straight[0] > 0.0015 and straight[1] < 0.0005


def terrace(cells: tuple[int, int]) -> TetMesh:
    """A terrace of 6 mm on a disc: a rim 7 mm from the hollow at its foot."""
    profile = np.array([[0.030, 0.0], [0.030, 0.020], [0.013, 0.020], [0.010, 0.026]])
    mesh = shapes.cylinder(0.030, 0.026, cells, order=1)
    points, r = mesh.points.copy(), np.hypot(*mesh.points[:, :2].T)
    top = np.interp(r, profile[:0:-1, 0], profile[:0:-1, 1])
    points[:, 2] *= np.where(r < 0.0295, top, 0.020) / 0.026
    return TetMesh(points, mesh.tetrahedra, mesh.fixed, mesh.touchable, turned_on_a_lathe(profile))


def test_a_rim_beside_a_hollow_keeps_its_place():
    """It was rounded as the hollow is, 0.45 mm off, and felt far too late."""
    mesh = terrace((12, 7))
    felt = contact_surface(mesh).arrays
    used = np.unique(felt.triangles[felt.free > 0])
    r, z = np.hypot(*felt.vertices[used, :2].T), felt.vertices[used, 2]
    off = np.abs(mesh.shape.distance(felt.vertices[used]))
    assert (z > 0.0255).sum() > 40
    assert off[z > 0.0255].max() < 3e-5
    assert felt.normals[used][(r < 0.0075) & (z > 0.02), 2].min() > 1 - 1e-6


def test_a_tip_that_slides_into_a_hollow_below_a_rim_never_steps():
    """Half a millimetre deep, down the slope, over the ground and back: the force fell to 0 or by a third."""
    ends = np.array([[0.0149, 0.0007, 0.0263], [0.01578, 0.0007, 0.0245], [0.0200, 0.0007, 0.0245]])
    down, along = (np.linspace(a, b, 1500) for a, b in zip(ends, ends[1:], strict=False))
    path = np.vstack([np.linspace(ends[0] + [2e-3, 0, 1e-3], ends[0], 500), down, along])
    path = np.vstack([path, path[:500:-1]])
    renderer = shapes.fem(shapes.model(terrace((8, 5)).quadratic()), dent_law="linear", friction=0.0)
    force = renderer.follow(renderer.start([TIP]), path[:, None], np.full(len(path), 1e-3))[:, 0]
    size = np.linalg.norm(force, axis=1)
    assert size[500:].min() > 0.005
    assert np.linalg.norm(np.diff(force, axis=0), axis=1).max() < 0.02 * size.max()


def test_a_crease_that_fades_leaves_no_triangle_without_area_and_no_normal_without_length():
    """A block with a roof on it: several fine vertices have the same end of its ridge as nearest crease."""

    def roof(p: np.ndarray) -> np.ndarray:
        x, y = np.abs(p[:, 0]), np.abs(p[:, 1])
        return 0.01 * np.clip(1 - y / 0.015, 0, 1) * np.clip(1 - x / 0.02, 0, 1)

    box = trimesh.creation.box(extents=(0.06, 0.06, 0.03))
    for _ in range(3):
        box = box.subdivide()
    vertices = box.vertices + [0, 0, 0.015]
    vertices[:, 2] += vertices[:, 2] / 0.03 * roof(vertices)
    mesh = shapes.block((0.06, 0.06, 0.03), (5, 5, 3), order=1)
    points = mesh.points.copy()
    points[:, 2] += np.isclose(points[:, 2], 0.03) * roof(points)
    shape = TrueShape(vertices, np.asarray(box.faces))
    felt = contact_surface(TetMesh(points, mesh.tetrahedra, mesh.fixed, mesh.touchable, shape)).arrays
    touched = felt.triangles[felt.free > 0]
    corner = felt.vertices[touched]
    twice = np.linalg.norm(np.cross(corner[:, 1] - corner[:, 0], corner[:, 2] - corner[:, 0]), axis=1)
    assert twice.min() > 1e-11
    normals = felt.normals[np.unique(touched)]
    np.testing.assert_allclose(np.linalg.norm(normals, axis=1), 1.0, atol=1e-12)
    assert np.isfinite(shape.curvatures(felt.vertices[np.unique(touched)], normals, 0.002)[0]).all()


def test_a_direction_that_is_none_is_that_of_what_is_around():
    up, along = np.array([0.0, 0.0, 1.0]), np.array([1.0, 0.0, 0.0])
    given = np.array([2 * along, np.zeros(3), np.full(3, np.nan), 1e-14 * along])
    np.testing.assert_array_equal(unit_vectors(given, np.tile(up, (4, 1))), [along, up, up, up])
    corners = np.array([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0], [0.5, 0.5, 1], [0.5, 0, 0]]) * 0.05
    # the edge of the foot has a corner more on one side: a triangle without area closes it
    faces = [[0, 2, 1], [0, 3, 2], [0, 5, 4], [5, 1, 4], [0, 1, 5], [1, 2, 4], [2, 3, 4], [3, 0, 4]]
    shape = TrueShape(corners, np.array(faces))
    _, normals = shape.on(np.array([4]), np.array([[0.2, 0.3, 0.5]]))
    assert np.linalg.norm(normals[0]) == pytest.approx(1.0)
    assert normals[0, 1] < 0, "it faces as what is beside it"


def test_normals_between_corners_belong_to_what_bends_one_way_and_back():
    """Waves on a ball, as long as four of its facets: the mean of two corners' normals is 2.7 degrees off."""
    ball = trimesh.creation.icosphere(subdivisions=3, radius=1.0)
    size, depth, waves = 0.02, 2e-4, 12.0

    def bulge(p: np.ndarray) -> np.ndarray:
        return size + depth * np.sin(waves * p[:, 0]) * np.sin(waves * p[:, 1])

    shape = TrueShape(ball.vertices * bulge(ball.vertices)[:, None], np.asarray(ball.faces))
    middles = np.repeat([[0.5, 0.5, 0.0]], len(shape.triangles), axis=0)
    points, normals = shape.on(np.arange(len(shape.triangles)), middles)
    step = 1e-7

    def outside(p: np.ndarray) -> np.ndarray:
        r = np.linalg.norm(p, axis=1)
        return r - bulge(p / r[:, None])

    slope = np.stack([outside(points + step * e) - outside(points - step * e) for e in np.eye(3)], axis=1)
    meant = slope / np.linalg.norm(slope, axis=1, keepdims=True)
    off = np.degrees(2 * np.arcsin(np.linalg.norm(normals - meant, axis=1) / 2))
    assert np.sqrt(np.mean(off**2)) < 2.2


def test_a_cones_tip_is_felt_where_it_is_whatever_the_mesh():
    """Two meshes ended 0.2 and 0.1 mm below it, and forces beside it were 9 % apart."""
    cone = trimesh.creation.cone(radius=0.03, height=0.05, sections=64)
    shape = TrueShape(np.asarray(cone.vertices), np.asarray(cone.faces))
    mesh = shapes.cylinder(0.03, 0.05, (6, 5), order=1)
    points = mesh.points * [1.0, 1.0, 0.995]
    points[:, :2] *= 1 - 0.97 * mesh.points[:, 2:] / 0.05
    felt = contact_surface(TetMesh(points, mesh.tetrahedra, mesh.fixed, mesh.touchable, shape)).arrays
    away = np.linalg.norm(felt.vertices - [0, 0, 0.05], axis=1)
    assert away.min() < 1e-6
    assert felt.normals[away.argmin()] == pytest.approx([0, 0, 1], abs=0.1)


def test_a_cone_does_not_bulge_below_its_tip():
    """All of its triangles meet at the tip: as one smooth corner it lifted them by 4.3 mm."""
    cone = trimesh.creation.cone(radius=0.03, height=0.05, sections=64)
    shape = TrueShape(np.asarray(cone.vertices), np.asarray(cone.faces))
    places = sample(shape.vertices, shape.triangles, 2000)
    points, normals = shape.foot(places[places[:, 2] > 1e-3])
    slant = np.array([0.05, 0.03]) / np.hypot(0.05, 0.03)
    round_about = np.hypot(points[:, 0], points[:, 1])
    off = (round_about - 0.03) * slant[0] + points[:, 2] * slant[1]
    assert np.abs(off).max() < 5e-5
    around = points[:, :2] / round_about[:, None]
    meant = np.column_stack([around * slant[0], np.full(len(points), slant[1])])
    assert np.einsum("kx,kx->k", normals, meant).min() > np.cos(np.radians(3))


@pytest.mark.parametrize("cells", [(6, 5), (9, 7)])
def test_refined_elements_fill_the_shape_and_not_its_chords(cells):
    """Two meshes of a fillet gave way up to 2 % differently, each on its own chords."""
    mesh = meshed(filleted(), cells)
    fine, _ = refined_near_surface(mesh, 0.006)
    nodes = np.setdiff1d(fine.touchable_surface, np.flatnonzero(fine.fixed))
    assert np.abs(off_filleted(fine.points[nodes])).max() < 1e-4
    assert fine.volumes.min() > 0 and fine.volumes.sum() > 1.005 * mesh.volumes.sum()


def test_curvatures_of_a_large_shape_take_no_more_pieces_than_memory_allows():
    """A ball of 0.6 m: pieces as fine as a small object's took gigabytes."""
    ball = trimesh.creation.icosphere(subdivisions=4, radius=0.3)
    shape = TrueShape(np.asarray(ball.vertices), np.asarray(ball.faces))
    point = np.array([[0.3, 0.0, 0.0]])
    bent, _ = shape.curvatures(point, point / 0.3, 2e-3)
    assert len(shape._bends[0]) < 400_000
    assert bent == pytest.approx(np.full((1, 2), 1 / 0.3), rel=0.02)


def test_curvatures_are_the_shapes_and_not_the_meshs():
    shape = filleted()
    wall, fillet = np.array([RADIUS, 0, 0.02]), FILLET / np.sqrt(2)
    middle = np.array([RADIUS - FILLET + fillet, 0.0, HEIGHT - FILLET + fillet])
    places = np.array([wall, middle, [0.005, 0.0, HEIGHT]])
    normals = np.array([[1, 0, 0], [np.sqrt(0.5), 0, np.sqrt(0.5)], [0, 0, 1.0]])
    values, direction = shape.curvatures(places, normals, 2.2e-3)
    around = np.sqrt(0.5) / middle[0]
    assert values == pytest.approx(np.array([[1 / RADIUS, 0], [1 / FILLET, around], [0, 0]]), abs=1.5)
    assert abs(direction[0] @ [0, 1, 0]) == pytest.approx(1, abs=1e-3)
    assert abs(direction[1] @ [np.sqrt(0.5), 0, -np.sqrt(0.5)]) == pytest.approx(1, abs=1e-2)
    made = shapes.model(meshed(shape, (6, 5)).quadratic())
    felt = contact_surface(made.mesh)
    field = FineSurface(made, felt, shapes.quick_compliance(made), dent_law("neo-hookean"))
    touched = np.unique(felt.arrays.triangles[felt.arrays.free > 0])
    bent = principal_curvatures(made.mesh, felt.arrays.vertices[touched], felt.arrays.normals[touched])
    felt_bend = ellipse_curvature(bent, made.tool.tip_radius_m)
    assert felt_bend == pytest.approx(field.curvature[touched])
    assert bent[:, 0].max() == pytest.approx(1 / FILLET, rel=0.05)


def test_a_gentle_crease_is_curvature_on_a_line_and_a_sharp_one_is_none():
    turn, width = np.radians(20), 2.2e-3
    for angle, there in ((turn, turn / (np.sqrt(2 * np.pi) * width)), (np.radians(60), 0.0)):
        drop = 0.03 * np.tan(angle / 2)
        outline = np.array([[-0.03, -0.05], [0.03, -0.05], [0.03, -drop], [0, 0], [-0.03, -drop]])
        ends = [np.insert(outline, 1, y, axis=1) for y in (-0.04, 0.04)]
        roof = trimesh.convex.convex_hull(np.vstack(ends))
        values, direction = TrueShape(roof.vertices, roof.faces).curvatures(
            np.zeros((1, 3)), np.array([[0, 0, 1.0]]), width
        )
        assert values[0] == pytest.approx([there, 0.0], rel=0.03, abs=0.5)
        assert not there or abs(direction[0, 0]) == pytest.approx(1.0, abs=1e-3)


def test_the_curvature_of_a_coarse_file_is_that_of_the_surface_that_is_felt():
    """Beside a paraboloid through that surface: its patches, a centimetre wide, do not meet smoothly."""
    lumpy = trimesh.creation.icosphere(subdivisions=2, radius=1.0)
    lumpy.vertices *= 1 + 0.08 * np.sin(lumpy.vertices @ [3.1, -1.7, 2.3])[:, None]
    shape = TrueShape(lumpy.vertices * [0.06, 0.04, 0.03], lumpy.faces)
    width, draw = 2.2e-3, np.random.default_rng(0)
    places, normals = shape.foot(sample(shape.vertices, shape.triangles, 40, 3))
    told = shape.curvatures(places, normals, width)[0].sum(axis=1)
    fitted = []
    for place, frame in zip(places, local_frames(normals), strict=True):
        beside = shape.foot(place + 2 * width * draw.uniform(-1, 1, (2000, 2)) @ frame[1:])[0]
        z, x, y = frame @ (beside - place).T
        columns = np.stack([np.ones_like(x), x, y, x * x, x * y, y * y], axis=1)
        weight = np.exp(-(x**2 + y**2) / width**2 / 4)
        bent = np.linalg.lstsq(columns * weight[:, None], z * weight, rcond=None)[0]
        fitted.append(-2 * (bent[3] + bent[5]))
    assert np.median(np.abs(told / fitted - 1)) < 0.12


@pytest.fixture(scope="module")
def rounded_and_sharp():
    """(how its rim bends, m; model of an object; its compliance) of two, solved once."""
    sharp = turned_on_a_lathe(np.array([[RADIUS, 0.0], [RADIUS, HEIGHT]]))
    made = [
        (bend, shapes.model(meshed(shape, (6, 6)).quadratic()))
        for bend, shape in ((FILLET, filleted()), (0.0, sharp))
    ]
    return [(bend, model, shapes.quick_compliance(model)) for bend, model in made]


@pytest.mark.parametrize(
    "mu",
    [
        pytest.param(0.3, marks=pytest.mark.slow),
        *(pytest.param(mu, marks=pytest.mark.release) for mu in (0.0, np.inf)),
    ],
)
def test_sliding_over_a_fillet_and_a_sharp_rim_never_steps(rounded_and_sharp, mu):
    step = 2e-6
    for fillet, made, compliance in rounded_and_sharp:
        renderer = shapes.fem(made, compliance=compliance, dent_law="linear", friction=mu)
        top = HEIGHT + TIP
        inwards = np.linspace([0.024, 0.003, top + 5e-4], [0.024, 0.003, top - 2e-3], 200)
        bend = fillet + 0.003  # 2 mm deep all the way round
        angle = np.arange(0, np.pi / 2, step / bend)
        centre = np.array([RADIUS + TIP - 0.002 - bend, 0.003, top - 0.002 - bend])
        over = centre + bend * np.column_stack([np.sin(angle), 0 * angle, np.cos(angle)])
        along = np.arange(inwards[-1, 0], over[0, 0], step)[:, None] * [1, 0, 0] + inwards[-1] * [0, 1, 1]
        path = np.vstack([inwards, along] if mu == np.inf else [inwards, along, over])
        force = renderer.follow(renderer.start([TIP]), path[:, None], np.full(len(path), 1e-3))[200:, 0]
        size = np.linalg.norm(force, axis=1)
        assert size.min() > 0.02
        assert (np.linalg.norm(np.diff(force, axis=0), axis=1) / size[:-1]).max() < 0.02


def test_a_model_keeps_its_shape(tmp_path):
    made = shapes.model(meshed(filleted(), (6, 5)).quadratic())
    again = read_model(write_model(tmp_path / "M", made))
    assert again.mesh.shape.key == made.mesh.shape.key
    assert again.mesh.linear().shape is again.mesh.shape
    plain = dataclasses.replace(made, mesh=dataclasses.replace(made.mesh, shape=None))
    assert read_model(write_model(tmp_path / "M", plain)).mesh.shape is None


@pytest.mark.parametrize("outwards", [0.0, -0.3, 0.3])
def test_the_contact_normal_at_the_rim_of_the_foot_is_that_of_the_side(outwards):
    """The base meets the side there and looks straight down; a side that hangs over or leans stays."""
    top = RADIUS * (1 + outwards)
    shape = turned_on_a_lathe(np.array([[RADIUS, 0.0], [top, HEIGHT]]))
    mesh = shapes.cylinder(RADIUS, HEIGHT, (6, 5), order=1)
    points = mesh.points.copy()
    points[:, :2] *= 1 + outwards * points[:, 2:] / HEIGHT
    on = mesh.touchable & ~mesh.fixed
    points[on] = shape.foot(points[on])[0]
    felt = contact_surface(TetMesh(points, mesh.tetrahedra, mesh.fixed, mesh.touchable, shape)).arrays
    rim = np.intersect1d(felt.triangles[felt.free > 0], felt.triangles[felt.free == 0])
    assert len(rim) > 60
    leans = -np.sin(np.arctan2(top - RADIUS, HEIGHT))
    np.testing.assert_allclose(felt.normals[rim, 2], leans, atol=0.03)
    radial = felt.vertices[rim, :2] / np.linalg.norm(felt.vertices[rim, :2], axis=1, keepdims=True)
    assert (np.einsum("vx,vx->v", felt.normals[rim, :2], radial) > 0.9).all()


def box(size_m: tuple[float, float, float], cells: tuple[int, int, int]) -> TetMesh:
    mesh, shell = shapes.block(size_m, cells, order=1), trimesh.creation.box(size_m)
    shape = TrueShape(shell.vertices + [0, 0, size_m[2] / 2], shell.faces)
    return TetMesh(mesh.points, mesh.tetrahedra, mesh.fixed, mesh.touchable, shape)


@pytest.fixture(scope="module")
def sharp() -> Model:
    """A block of 80 mm whose shape is known."""
    return shapes.model(box((0.08, 0.08, 0.04), (8, 8, 4)).quadratic())


def test_what_is_rendered_beside_a_rim_is_what_is_solved_there(sharp):
    """To 3 % of a half-space's compliance: between corners 1.75 patches apart 9 % were lost."""
    renderer = create("fem", sharp, RenderOptions(), on_demand=True)
    arrays = renderer.contact.arrays
    at = np.flatnonzero(
        (arrays.vertices[:, 2] > 0.04 - 1e-9)
        & (np.abs(arrays.vertices[:, 1]) < 3e-3)
        & (arrays.vertices[:, 0] > 0.031)
        & (arrays.normals[:, 2] > 1 - 1e-9)
    )
    assert len(at) > 5
    points, normals = arrays.vertices[at], arrays.normals[at]
    nu = sharp.material.poisson_ratio
    solved = touch_sites(sharp.mesh, points, normals, nu, solver=renderer.compliance._fine.solver).far
    off = (renderer.far_at(at) - solved)[:, 2, 2]
    assert np.abs(off).max() < 0.03 * (1 - nu**2) / (2 * np.sqrt(np.pi) * 0.004)


def test_a_rim_is_felt_between_vertices_as_at_them():
    """Fine edges of 2 to 3 mm beside a rim bent it otherwise by an eighth of the tip's curvature."""
    mesh = meshed(turned_on_a_lathe(np.array([[RADIUS, 0.0], [RADIUS, HEIGHT]])), (6, 5))
    arrays = contact_surface(mesh).arrays
    free = arrays.triangles[arrays.free > 0]
    corners, facing = arrays.vertices[free], arrays.normals[free]
    middle = edge_law(mesh, corners.mean(axis=1), unit_vectors(facing.sum(axis=1), facing[:, 0]))
    ends = edge_law(mesh, corners.reshape(-1, 3), facing.reshape(-1, 3)).curvature.reshape(-1, 3)
    assert TIP * np.abs(ends.mean(axis=1) - middle.curvature).max() < 0.05


def test_at_a_corner_of_rims_the_normal_turns_towards_both():
    """It turned to one: two meshes of a cube were 5 % apart 1 mm from its corner."""
    leans = []
    for across in (7, 8, 9, 11):
        arrays = contact_surface(box((0.08, 0.08, 0.04), (across, across, 4))).arrays
        used = np.unique(arrays.triangles[arrays.free > 0])
        v, n = arrays.vertices[used], arrays.normals[used]
        away = 0.04 - np.abs(v[:, :2])
        alike = (v[:, 2] > 0.04 - 1e-9) & (away.min(axis=1) > 2e-4) & (away.max(axis=1) < 1.5e-3)
        alike &= away.max(axis=1) < 1.5 * away.min(axis=1)
        leans.append(np.sort(np.abs(n[alike, :2]), axis=1))
    less, more = np.vstack(leans).T
    assert len(less) > 5 and more.min() > 0.1
    assert (less > 0.5 * more).all()
