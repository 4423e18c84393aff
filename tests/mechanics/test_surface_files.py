"""Surfaces of other programs: every format to the same solid, holes closed or refused with their place,
units."""

from __future__ import annotations

import json
import sys
import warnings
from pathlib import Path

import meshio
import numpy as np
import pytest
import pyvista
import trimesh
from pyvista import examples

from palpate.mechanics.disk.surface_files import UNITS, ClosedSurface, read_surface
from palpate.mechanics.errors import PalpateWarning, SurfaceError
from palpate.mechanics.shape.flat_foot import PointFoot, TiltedFoot, direction, standing
from palpate.mechanics.shape.tetmesh import box_mesh

SIZE_MM = (60, 50, 40)


def volume(surface: ClosedSurface) -> float:
    shell = trimesh.Trimesh(surface.vertices, surface.triangles, process=False)
    assert shell.is_watertight and shell.is_winding_consistent
    return float(shell.volume)


def written(folder, name: str):
    """A block of 60 x 50 x 40 mm, in mm, in one of the formats."""
    path, suffix = folder / name, name.rsplit(".", 1)[1]
    block = box_mesh((3, 3, 2), SIZE_MM)
    if suffix in ("vtu", "inp"):
        meshio.Mesh(block.points, [("tetra", block.tetrahedra)]).write(path)
    elif suffix == "msh":
        # Gmsh writes the boundary's triangles beside the tetrahedra
        cells = [("tetra", block.tetrahedra), ("triangle", block.surface)]
        meshio.Mesh(block.points, cells).write(path, file_format="gmsh22")
    else:
        shell = trimesh.creation.box(extents=SIZE_MM)
        if suffix == "vtp":
            pyvista.wrap(shell).save(path)
        else:
            shell.export(path)
    return path


@pytest.mark.parametrize("suffix", ["stl", "obj", "ply", "glb", "vtp", "vtu", "msh", "inp"])
def test_every_format_holds_the_same_solid(tmp_path, suffix):
    surface = read_surface(written(tmp_path, f"block.{suffix}"), "mm")
    assert volume(surface) == pytest.approx(60 * 50 * 40 * 1e-9, rel=1e-6)
    assert surface.size_m == pytest.approx(0.06)


def test_a_size_that_no_hand_explores_is_said_with_the_unit_that_fits(tmp_path):
    """150 mm taken for cm was meshed for minutes before anything was said."""
    trimesh.creation.box(extents=(150, 110, 60)).export(path := tmp_path / "liver.stl")
    with pytest.warns(PalpateWarning, match="1.5 m: these look like mm: give --unit mm"):
        read_surface(path, "cm")
    with warnings.catch_warnings():
        warnings.simplefilter("error", PalpateWarning)
        read_surface(path, "mm")


def test_a_quadratic_mesh_keeps_its_corners(tmp_path):
    block = box_mesh((2, 2, 2), SIZE_MM).quadratic()
    meshio.Mesh(block.points, [("tetra10", block.tetrahedra)]).write(tmp_path / "q.vtu")
    assert volume(read_surface(tmp_path / "q.vtu", "mm")) == pytest.approx(1.2e-4)


def without(shell: trimesh.Trimesh, gone: np.ndarray, path):
    shell.update_faces(~gone)
    shell.export(path)
    return path


@pytest.mark.parametrize("name", ["nut", "ant", "hexbeam", "uniform"])
def test_a_visualisers_own_examples_are_solids(tmp_path, name):
    """Files that come with PyVista; of a grid without cells of its own nothing was read."""
    path = next(Path(examples.__file__).parent.glob(f"{name}.*"))
    size = float(np.ptp(np.reshape(pyvista.read(path).bounds, (3, 2)), axis=1).max())
    unit = next(unit for unit, metres in UNITS.items() if 0.004 < size * metres < 1)
    found = read_surface(path, unit)
    assert found.size_m == pytest.approx(size * UNITS[unit], rel=1e-5)
    assert trimesh.Trimesh(found.vertices, found.triangles, process=False).is_volume


def test_small_and_flat_holes_are_closed(tmp_path):
    cylinder = trimesh.creation.cylinder(radius=30, height=50, sections=64)
    whole = cylinder.volume
    bare = read_surface(without(cylinder, cylinder.face_normals[:, 2] < -0.9, tmp_path / "bare.stl"), "mm")
    assert bare.notes == ("1 hole closed",) and volume(bare) == pytest.approx(whole * 1e-9, rel=1e-6)
    ball = trimesh.creation.icosphere(subdivisions=3, radius=30)
    whole = ball.volume
    pierced = np.linalg.norm(ball.triangles_center - [0, 0, 30], axis=1) < 2.5
    assert volume(read_surface(without(ball, pierced, tmp_path / "b.stl"), "mm")) == pytest.approx(
        whole * 1e-9, rel=2e-3
    )


def test_a_wide_hole_is_refused_with_its_place(tmp_path):
    ball = trimesh.creation.icosphere(subdivisions=3, radius=30)
    gone = (ball.triangles_center[:, 0] > 10) & (ball.triangles_center[:, 1] > 0)
    with pytest.raises(SurfaceError, match=r"hole 5\d\.?\d* mm wide at \(1\d\.?\d*, ") as refused:
        read_surface(without(ball, gone, tmp_path / "open.ply"), "mm")
    assert len(str(refused.value).splitlines()) == 1


def test_a_scan_of_what_stands_on_a_table_is_closed_at_the_table_and_there_alone(tmp_path):
    """A wavy rim, 2 to 5 mm up: what lies between it and the lowest node belongs to the object."""
    tube = trimesh.creation.cylinder(radius=30, height=50, sections=96).subdivide_to_size(4)
    tube.apply_translation([0, 0, 25])
    x, _, z = tube.triangles_center.T
    path = without(tube, z < 3.5 + 1.5 * np.sin(x / 8), tmp_path / "scan.stl")
    low = float(trimesh.load(path).bounds[0, 2])
    found = read_surface(path, "mm", direction("+z"))
    assert volume(found) == pytest.approx(np.pi * 30**2 * (50 - low) * 1e-9, rel=5e-3)
    assert "closed at the support" in found.notes[0]
    foot = standing(found)
    assert foot.support_point[2] == pytest.approx(1e-3 * low, abs=1e-9)
    for up in ("-z", "+x"):
        with pytest.raises(SurfaceError, match="hole 6"):
            read_surface(path, "mm", direction(up))


def test_triangles_wound_at_random_come_out_outward(tmp_path):
    shell = trimesh.creation.box(extents=SIZE_MM)
    faces = shell.faces.copy()
    faces[::3] = faces[::3, ::-1]
    lines = [f"v {x} {y} {z}" for x, y, z in shell.vertices] + [f"f {a} {b} {c}" for a, b, c in faces + 1]
    (tmp_path / "mixed.obj").write_text("\n".join(lines))
    assert volume(read_surface(tmp_path / "mixed.obj", "mm")) == pytest.approx(1.2e-4)


@pytest.mark.parametrize(
    ("unit", "words"), [("m", "these look like mm: give --unit mm"), ("um", "--unit mm")]
)
def test_units_that_make_no_object_for_a_hand_are_named(tmp_path, unit, words):
    with pytest.raises(SurfaceError, match=words):
        read_surface(written(tmp_path, "block.stl"), unit)


def _declaring(kind: str, cells: str) -> bytes:
    """A file of 100 bytes that asks VTK for room for 10^11 points."""
    many = "9" * 11
    return (
        f'<VTKFile type="{kind}"><{kind}><Piece NumberOfPoints="{many}" {cells}="{many}"/></{kind}></VTKFile>'
    ).encode()


@pytest.mark.parametrize(
    ("name", "content", "words"),
    [
        ("bad.stl", b"hello", "no triangles"),
        ("bad.msh", b"foo", "cannot be read as msh"),
        ("cut.msh", b"(10 (1 1 f 1)(\n" + bytes(9), "cannot be read as msh"),
        ("bad.inp", b"\x00\xff", "cannot be read as inp"),
        ("bad.vtu", b"<a/>", "is damaged: VTK cannot read it"),
        ("thing.step", b"", "allowed are stl, obj"),
        ("gone.stl", None, "does not exist"),
        ("huge.vtu", _declaring("UnstructuredGrid", "NumberOfCells"), "NumberOfPoints of 9+ in a file"),
        ("huge.vtp", _declaring("PolyData", "NumberOfPolys"), "NumberOfPoints of 9+ in a file"),
    ],
)
def test_bad_files_are_one_line(tmp_path, capfd, name, content, words):
    if content is not None:
        (tmp_path / name).write_bytes(content)
    with pytest.raises(SurfaceError, match=words) as refused:
        read_surface(tmp_path / name)
    assert len(str(refused.value).splitlines()) == 1
    assert capfd.readouterr() == ("", "")


def surface_of(shell: trimesh.Trimesh) -> ClosedSurface:
    return ClosedSurface(np.array(shell.vertices), np.array(shell.faces), "thing.stl")


NOTED: list[str] | None = None


def note(event: str, arguments: tuple) -> None:
    if NOTED is not None and event in ("open", "socket.connect", "socket.getaddrinfo", "subprocess.Popen"):
        NOTED.append(f"{event} {arguments}")


@pytest.fixture
def opened(monkeypatch):
    """What is opened, called or started while a test runs (hooks stay for good, so this one sleeps)."""
    sys.addaudithook(note)
    noted: list[str] = []
    monkeypatch.setattr(sys.modules[__name__], "NOTED", noted)
    return noted


@pytest.mark.parametrize("uri", ["../secret.bin", "ABSOLUTE", "file://ABSOLUTE", "http://127.0.0.1:9/s.bin"])
def test_a_gltf_reads_nothing_outside_its_folder_and_calls_nobody(tmp_path, opened, uri):
    """Its triangles lie in a buffer that is named: a sound one, outside of the file's folder."""
    (tmp_path / "folder").mkdir()
    box = trimesh.creation.box(extents=SIZE_MM)
    places, corners = np.asarray(box.vertices, "<f4").tobytes(), np.asarray(box.faces, "<u4").tobytes()
    (tmp_path / "secret.bin").write_bytes(places + corners)
    attributes = {"attributes": {"POSITION": 0}, "indices": 1}
    buffer = {"uri": uri.replace("ABSOLUTE", f"{tmp_path}/secret.bin"), "byteLength": len(places + corners)}
    (tmp_path / "folder" / "block.gltf").write_text(json.dumps({
        "asset": {"version": "2.0"}, "scene": 0, "scenes": [{"nodes": [0]}], "nodes": [{"mesh": 0}],
        "meshes": [{"primitives": [attributes]}],
        "accessors": [
            {"bufferView": 0, "componentType": 5126, "count": len(box.vertices), "type": "VEC3"},
            {"bufferView": 1, "componentType": 5125, "count": box.faces.size, "type": "SCALAR"},
        ],
        "bufferViews": [
            {"buffer": 0, "byteLength": len(places)},
            {"buffer": 0, "byteOffset": len(places), "byteLength": len(corners)},
        ],
        "buffers": [buffer],
    }))  # fmt: skip
    opened.clear()
    with pytest.raises(SurfaceError) as refusal:
        read_surface(tmp_path / "folder" / "block.gltf", "mm")
    assert "\n" not in str(refusal.value) and len(str(refusal.value)) < 400
    assert not [x for x in opened if "secret" in x or "passwd" in x or not x.startswith("open")]


def test_an_obj_reads_nothing_outside_its_folder_and_calls_nobody(tmp_path, opened):
    path = written(tmp_path, "block.obj")
    (tmp_path / "secret.mtl").write_text("newmtl a\nmap_Kd /etc/passwd\n")
    folder = tmp_path / "folder"
    folder.mkdir()
    for where in ("../secret.mtl", str(tmp_path / "secret.mtl"), "http://127.0.0.1:9/s.mtl"):
        (folder / "block.obj").write_text(f"mtllib {where}\nusemtl a\n{path.read_text()}")
        opened.clear()
        assert volume(read_surface(folder / "block.obj", "mm")) == pytest.approx(1.2e-4, rel=1e-6)
        assert not [x for x in opened if "secret.mtl" in x or "passwd" in x or not x.startswith("open")]


def test_an_object_without_a_foot_says_what_to_do_and_can_be_cut():
    ball = surface_of(trimesh.creation.icosphere(subdivisions=4, radius=0.03))
    with pytest.raises(SurfaceError, match="no flat foot .* --sink"):
        standing(ball)
    cut = standing(ball, sink_m=0.003)
    shell = trimesh.Trimesh(cut.vertices, cut.triangles, process=False)
    assert shell.is_watertight
    cap = np.pi * 0.003**2 * (0.03 - 0.001)
    assert shell.volume == pytest.approx(4 / 3 * np.pi * 0.03**3 - cap, rel=0.005)
    assert cut.support_point == pytest.approx([0, 0, -0.027], abs=1e-6)


def test_a_round_underside_is_told_to_stand_on_a_point_and_a_flat_one_is_not():
    flat = trimesh.creation.icosphere(subdivisions=4, radius=0.03).apply_scale([1, 1, 0.5])
    with pytest.warns(PointFoot, match=r"stands on a point.* --sink 0.00[12] "):
        standing(surface_of(flat))
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        standing(surface_of(flat), sink_m=0.002)
        standing(surface_of(trimesh.creation.box(extents=(0.06, 0.05, 0.04))))
        standing(surface_of(trimesh.creation.cone(0.02, 0.04)))


def test_up_is_a_direction_of_the_file():
    block = surface_of(trimesh.creation.box(extents=(0.06, 0.05, 0.04)))
    for up, height in (("+z", 0.04), ("-x", 0.06), ("0,1,0", 0.05)):
        stood = standing(block, up)
        reach = (stood.vertices - stood.support_point) @ stood.support_normal
        assert reach.min() == pytest.approx(0, abs=1e-12) and reach.max() == pytest.approx(height)
    with pytest.raises(SurfaceError, match="allowed are"):
        standing(block, "z up")
    leaning = trimesh.creation.box(extents=(0.06, 0.05, 0.04))
    leaning.apply_transform(trimesh.transformations.rotation_matrix(0.5, [1, 0, 0]))
    with pytest.raises(SurfaceError, match=r"flat ones are for --up \+x, -x"):
        standing(surface_of(leaning))


def test_a_foot_of_any_direction_is_named_where_none_lies_along_an_axis():
    """As a scanner's frame has it; a round top is no foot."""
    dome = trimesh.creation.icosphere(subdivisions=4, radius=0.05)
    cut = pyvista.wrap(dome).clip_closed_surface((0, 0, 1), origin=(0, 0, -0.02)).triangulate().clean()
    dome = trimesh.Trimesh(cut.points, cut.regular_faces)
    turn = trimesh.transformations.rotation_matrix(np.radians(44), [1, 0.4, 0.1])
    dome.apply_transform(turn)
    with pytest.raises(SurfaceError, match=r"its flat foot is for --up=") as refused:
        standing(surface_of(dome))
    up = str(refused.value).split("--up=")[1].split(";")[0]
    assert standing(surface_of(dome), up).support_normal == pytest.approx(turn[:3, 2], abs=1e-3)
    level = dome.copy()
    level.apply_transform(np.linalg.inv(turn))
    level.apply_transform(trimesh.transformations.rotation_matrix(np.pi / 2, [1, 0, 0]))
    with pytest.raises(SurfaceError, match=r"flat ones are for --up -y; or"):
        standing(surface_of(level))


def test_a_sink_that_is_proposed_makes_the_object_stand():
    """Round undersides, one of two bodies, one 6 mm higher: each value is taken as it is said."""
    ball = trimesh.creation.icosphere(subdivisions=4, radius=0.03)
    high = ball.copy()
    high.apply_translation([0.08, 0, 0.006])
    slender = ball.copy().apply_scale([0.2, 0.2, 1.0])
    for shell in (ball, slender, trimesh.util.concatenate([ball, high])):
        thing = surface_of(shell)
        with pytest.raises(SurfaceError, match="--sink") as refused:
            standing(thing)
        cut = standing(thing, sink_m=float(str(refused.value).rsplit("--sink ", 1)[1]))
        pieces = trimesh.Trimesh(cut.vertices, cut.triangles, process=False).split()
        lowest = [piece.bounds[0, 2] for piece in pieces]
        assert lowest == pytest.approx([cut.support_point[2]] * len(pieces), abs=1e-9)


def test_a_body_in_the_air_is_refused_and_one_that_touches_what_stands_is_not():
    def stack(low):
        block, other = (trimesh.creation.box(extents=(0.06, 0.05, 0.04)) for _ in range(2))
        other.apply_translation([0.005, 0, low])
        return surface_of(trimesh.util.concatenate([block, other]))

    with pytest.raises(SurfaceError, match="50 % of their volume touches neither"):
        standing(stack(0.05))
    assert len(standing(stack(0.03)).triangles) == 24


def test_nothing_of_a_rough_foot_hangs_below_the_support():
    """One corner of the rim lies 0.3 mm lower, and the triangles at it are too steep to be the foot's."""
    cylinder = trimesh.creation.cylinder(radius=0.03, height=0.04, sections=128).subdivide().subdivide()
    low, far = cylinder.vertices[:, 2].min(), np.linalg.norm(cylinder.vertices[:, :2], axis=1)
    rim = np.flatnonzero((cylinder.vertices[:, 2] == low) & (far > 0.0299))
    cylinder.vertices[rim[0]] -= [0, 0, 3e-4]
    with warnings.catch_warnings():
        warnings.simplefilter("error", TiltedFoot)
        stood = standing(surface_of(cylinder))
    reach = (stood.vertices - stood.support_point) @ stood.support_normal
    assert reach.min() == pytest.approx(0, abs=1e-12)


def test_a_foot_that_is_tilted_in_the_file_is_stood_on_and_said():
    block = trimesh.creation.box(extents=(0.06, 0.05, 0.04))
    turn = trimesh.transformations.rotation_matrix(np.radians(7.5), [1, 0.4, 0])
    block.apply_transform(turn)
    own = turn[:3, :3] @ [0, 0, 1]
    with pytest.warns(TiltedFoot, match="0 % of the flat foot .* tilted by 7.5 degrees"):
        found = standing(surface_of(block))
    assert found.support_normal == pytest.approx(own, abs=1e-9)
    reach = (found.vertices - found.support_point) @ own
    assert reach.min() == pytest.approx(0, abs=1e-9) and reach.max() == pytest.approx(0.04)
    with warnings.catch_warnings():
        warnings.simplefilter("error", TiltedFoot)
        standing(surface_of(block), ",".join(map(str, own)))


@pytest.mark.parametrize("ending", ["msh", "inp"])
def test_a_library_that_is_not_installed_is_named_with_its_extra(tmp_path, monkeypatch, ending):
    (tmp_path / f"a.{ending}").write_text("$MeshFormat")
    monkeypatch.setitem(sys.modules, "meshio", None)
    with pytest.raises(SurfaceError, match=r"needs meshio .* pip install 'meshio>="):
        read_surface(tmp_path / f"a.{ending}")


def test_gmshs_first_format_is_read(tmp_path):
    block = box_mesh((3, 3, 2), SIZE_MM)
    nodes = "\n".join(f"{k + 1} {x:.6f} {y:.6f} {z:.6f}" for k, (x, y, z) in enumerate(block.points))
    rows = [f"{k + 1} 4 1 1 4 " + " ".join(str(n + 1) for n in t) for k, t in enumerate(block.tetrahedra)]
    text = (
        f"$NOD\n{len(block.points)}\n{nodes}\n$ENDNOD\n$ELM\n{len(rows)}\n" + "\n".join(rows) + "\n$ENDELM\n"
    )
    (tmp_path / "old.msh").write_text(text)
    assert volume(read_surface(tmp_path / "old.msh", "mm")) == pytest.approx(1.2e-4, rel=1e-6)
    (tmp_path / "torn.msh").write_text(text[: len(text) // 2])
    with pytest.raises(SurfaceError, match="cannot be read as msh"):
        read_surface(tmp_path / "torn.msh", "mm")


def test_a_surface_that_crosses_itself_is_one_line_without_a_librarys_warning(tmp_path, recwarn):
    shell = trimesh.creation.box(extents=SIZE_MM)
    points = np.array(shell.vertices)
    top = points[:, 2] > 0
    points[top, 0] *= -1  # the top is mirrored, and the sides cross
    trimesh.Trimesh(points, shell.faces, process=False).export(tmp_path / "twisted.obj")
    with pytest.raises(SurfaceError, match="encloses no volume"):
        read_surface(tmp_path / "twisted.obj", "mm")
    assert not recwarn.list


def named(folder, *boxes):
    """An OBJ of boxes (name, extents mm, place)."""
    lines, first = [], 1
    for name, extents, at in boxes:
        box = trimesh.creation.box(extents=extents)
        lines += [f"o {name}", *(f"v {x} {y} {z}" for x, y, z in box.vertices + np.array(at))]
        lines += [f"f {a + first} {b + first} {c + first}" for a, b, c in box.faces]
        first += len(box.vertices)
    (folder / "named.obj").write_text("\n".join(lines) + "\n")
    return folder / "named.obj"


@pytest.mark.parametrize("at", [(0, 0, 0), (90, 0, 0)])
def test_bodies_inside_or_beside_one_another_are_listed_with_their_volumes(tmp_path, at):
    found = read_surface(named(tmp_path, ("liver", SIZE_MM, (0, 0, 0)), ("tumour", (10, 10, 10), at)), "mm")
    assert {p.name: round(1e6 * p.volume_m3, 6) for p in found.parts} == {"liver": 120.0, "tumour": 1.0}
    assert read_surface(written(tmp_path, "one.obj"), "mm").parts == ()


def test_bodies_that_share_a_face_are_joined_and_a_surface_of_two_sides_is_one(tmp_path):
    layers = [trimesh.creation.box(extents=(0.05, 0.05, 0.015)) for _ in range(3)]
    layers[1].apply_scale([1, 1, -1])  # the same diagonals on both sides of a wall, as a mesher leaves it
    for k, layer in enumerate(layers):
        layer.apply_translation([0, 0, 0.015 * k])
    trimesh.util.concatenate(layers).export(tmp_path / "layers.stl")
    found = read_surface(tmp_path / "layers.stl")
    assert volume(found) == pytest.approx(0.05 * 0.05 * 0.045, rel=1e-5)
    assert "bodies that touch joined" in found.notes and not found.parts
    ball = trimesh.creation.icosphere(subdivisions=2, radius=0.03)
    both = np.vstack([ball.faces, ball.faces[:, ::-1]])
    trimesh.Trimesh(ball.vertices, both, process=False).export(tmp_path / "twice.stl")
    found = read_surface(tmp_path / "twice.stl")
    assert volume(found) == pytest.approx(ball.volume, rel=1e-5)


def test_specks_beside_a_body_are_left_out_and_said_and_a_small_part_inside_stays(tmp_path):
    def read(*shells):
        trimesh.util.concatenate(shells).export(tmp_path / "dusty.ply")
        return read_surface(tmp_path / "dusty.ply")

    ball = trimesh.creation.icosphere(subdivisions=3, radius=0.03)
    dust = [trimesh.creation.icosphere(subdivisions=0, radius=6e-4) for _ in range(3)]
    for speck, at in zip(dust, ([0.04, 0, 0], [0.024, 0.024, 0.024], [0.05, 0.01, -0.04]), strict=True):
        speck.apply_translation(at)
    found = read(ball, *dust)
    assert volume(found) == pytest.approx(ball.volume, rel=1e-5)
    assert not found.parts and "3 specks" in found.notes[-1]
    inside = trimesh.creation.icosphere(subdivisions=1, radius=6e-4)
    assert len(read(ball, inside).parts) == 2


def test_labels_of_cells_are_listed_with_their_volumes(tmp_path):
    block = box_mesh((4, 4, 4), SIZE_MM)
    label = (block.points[block.tetrahedra].mean(axis=1)[:, 0] > block.points[:, 0].mean()).astype(int) + 1
    held = {"tissue": [label]}
    meshio.Mesh(block.points, [("tetra", block.tetrahedra)], cell_data=held).write(tmp_path / "two.vtu")
    found = read_surface(tmp_path / "two.vtu", "mm").parts
    assert [p.name for p in found] == ["tissue 1", "tissue 2"]
    assert [p.volume_m3 for p in found] == pytest.approx([6e-5, 6e-5], rel=1e-6)


@pytest.mark.parametrize("turned_over", [False, True])
@pytest.mark.parametrize("lean_deg", [20.0, 70.0])
def test_an_object_that_leans_is_told_the_way_up_that_does_not_turn_it_over(lean_deg, turned_over):
    """Of a cylinder's two ends, alike, the top was called its foot: it was stood on its head."""
    leaning = trimesh.creation.cylinder(0.03, 0.05, sections=64)
    if turned_over:
        leaning.apply_transform(trimesh.transformations.rotation_matrix(np.pi, (1, 0, 0)))
    leaning.apply_transform(trimesh.transformations.rotation_matrix(np.radians(lean_deg), (0.3, 1.0, 0.1)))
    with pytest.raises(SurfaceError, match="its flat foot is for --up=") as refused:
        standing(surface_of(leaning))
    up = str(refused.value).split("--up=")[1].split(";")[0]
    assert direction(up)[2] == pytest.approx(np.cos(np.radians(lean_deg)), abs=0.03)
    stood = standing(surface_of(leaning), up=up)
    assert stood.support_normal @ direction(up) == pytest.approx(1.0, abs=1e-3)
