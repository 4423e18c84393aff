"""A model in other programs' files: each read back to the same mesh and moduli; MuJoCo's scene is run."""

from __future__ import annotations

import contextlib
import json
import re
import subprocess
import sys
import xml.etree.ElementTree as tree

import meshio
import numpy as np
import pytest
import trimesh

import palpate as pp
from palpate import cli
from palpate.mechanics.disk.surface_files import read_surface
from palpate.mechanics.model.files import write_model
from palpate.mechanics.model.material import Ball, Material
from palpate.mechanics.model.model import Model, Support, Tool
from palpate.mechanics.shape.tetmesh import box_mesh
from palpate.render.simulators.mujoco import force_on_tip

SIZE = (0.06, 0.05, 0.03)
MATERIAL = ("youngsModulus", "poissonsRatio", "density", "dynamicFriction")


def block(nu: float = 0.49, order: int = 2, ball: bool = True, cells=(8, 7, 5)) -> Model:
    mesh = box_mesh(cells, SIZE)
    inside = {"lump": Ball((0.0, 0.0, 0.015), 0.008, 5.0)} if ball else {}
    return Model(
        mesh=mesh if order == 1 else mesh.quadratic(),
        material=Material(15e3, nu, inclusions=inside),
        support=Support(np.zeros(3), np.array([0.0, 0.0, 1.0])),
        tool=Tool(0.005),
        mesh_size_m=0.0075,
    )


@pytest.mark.parametrize("order", [1, 2])
def test_gmsh_holds_mesh_groups_and_moduli(tmp_path, order):
    model = block(order=order)
    pp.export(model, "gmsh", tmp_path / "m.msh", progress=False)
    found = meshio.read(tmp_path / "m.msh")
    kind = "tetra" if order == 1 else "tetra10"
    assert np.allclose(found.points, model.mesh.points)
    assert np.array_equal(found.cells_dict[kind], model.mesh.tetrahedra)
    assert set(found.field_data) == {"object", "base", "touchable"}
    number = [block.type for block in found.cells].index(kind)
    moduli = np.ravel(found.cell_data["young_modulus_pa"][number])
    assert np.allclose(moduli, 15e3 * model.element_ratio) and np.ptp(moduli) > 1e4
    faces = sum(len(b.data) for b in found.cells if b.type.startswith("triangle"))
    assert faces == len(model.mesh.surface)


def test_abaqus_holds_mesh_base_and_a_step(tmp_path):
    model = block()
    pp.export(model, "abaqus", tmp_path / "m.inp", progress=False)
    text = (tmp_path / "m.inp").read_text()
    keywords = [line.split(",")[0].lower() for line in text.splitlines() if line.startswith("*")]
    for needed in ("*rigid body", "*contact pair", "*step", "*static", "*end step", "*solid section"):
        assert needed in keywords
    stated = {float(m) for m in re.findall(r"\*Elastic\n([^,]+),", text)}
    assert sorted(stated) == pytest.approx(np.unique(15e3 * model.element_ratio).tolist(), rel=1e-6)
    found = meshio.read(tmp_path / "m.inp")
    tets = np.vstack([b.data for b in found.cells if b.type.startswith("tetra")])
    assert np.allclose(found.points[:-1], model.mesh.points)
    rows = np.lexsort(np.sort(tets, axis=1).T)
    same = np.lexsort(np.sort(model.mesh.tetrahedra, axis=1).T)
    assert np.array_equal(tets[rows], model.mesh.tetrahedra[same])
    base = np.sort(found.point_sets["BASE"])
    assert np.array_equal(base, np.flatnonzero(model.mesh.fixed))


def test_sofa_holds_mesh_base_and_moduli(tmp_path):
    model = block()
    pp.export(model, "sofa", tmp_path / "m.scn", progress=False)
    root = tree.parse(tmp_path / "m.scn").getroot()
    linear = model.mesh.linear()
    topology = root.find(".//TetrahedronSetTopologyContainer")
    assert np.allclose(np.fromstring(topology.get("position"), sep=" "), linear.points.ravel())
    assert np.array_equal(
        np.fromstring(topology.get("tetrahedra"), sep=" ", dtype=int), linear.tetrahedra.ravel()
    )
    fixed = root.find(".//FixedProjectiveConstraint").get("indices")
    assert np.array_equal(np.fromstring(fixed, sep=" ", dtype=int), np.flatnonzero(linear.fixed))
    moduli = np.fromstring(root.find(".//TetrahedronFEMForceField").get("youngModulus"), sep=" ")
    assert np.allclose(moduli, 15e3 * model.element_ratio)


@pytest.fixture(scope="module")
def stage(tmp_path_factory):
    path = tmp_path_factory.mktemp("usd") / "m.usda"
    model = block(nu=0.4).replaced(effects={"friction_slip": {"mu": 0.3}})
    notes = pp.export(model, "usd", path, progress=False)
    assert any("friction 0.3" in note for note in notes)
    return model, path


def test_usd_is_a_stage_with_a_deformable_and_its_material(stage):
    pxr = pytest.importorskip("pxr.Usd")
    from pxr import UsdGeom, UsdShade

    model, path = stage
    opened = pxr.Stage.Open(str(path))
    mesh = UsdGeom.TetMesh(opened.GetPrimAtPath("/World/Object/Mesh"))
    linear = model.mesh.linear()
    assert UsdGeom.GetStageMetersPerUnit(opened) == 1.0
    assert np.allclose(np.array(mesh.GetPointsAttr().Get()), linear.points, atol=1e-7)
    assert np.array_equal(np.array(mesh.GetTetVertexIndicesAttr().Get()), linear.tetrahedra)
    applied = mesh.GetPrim().GetPrimTypeInfo().GetAppliedAPISchemas()
    assert {"PhysicsVolumeDeformableSimAPI", "PhysicsCollisionAPI"} <= set(applied)
    bound, _ = UsdShade.MaterialBindingAPI(mesh.GetPrim()).ComputeBoundMaterial("physics")
    values = [bound.GetPrim().GetAttribute(f"physics:{name}").Get() for name in MATERIAL]
    mean = 15e3 * np.average(model.element_ratio, weights=linear.volumes)
    assert values == pytest.approx([mean, 0.4, 1000.0, 0.3], rel=1e-5)


def test_newton_imports_the_stage_with_modulus_and_held_base(stage):
    newton = pytest.importorskip("newton")
    pytest.importorskip("newton_usd_schemas")
    model, path = stage
    builder = newton.ModelBuilder()
    builder.add_usd(str(path))
    linear = model.mesh.linear()
    assert builder.particle_count == len(linear.points) and builder.tet_count == len(linear.tetrahedra)
    young = 15e3 * np.average(model.element_ratio, weights=linear.volumes)
    assert np.ravel(builder.tet_materials[0])[0] == pytest.approx(young / 2.8, rel=1e-5)
    assert sum(builder.particle_mass) == pytest.approx(1000 * linear.volumes.sum(), rel=1e-4)
    held = [prim for prim in vars(builder) if "attachment" in prim and "particle" in prim]
    assert any(len(getattr(builder, name)) == linear.fixed.sum() for name in held)


@pytest.mark.parametrize("to", ["newton", "drake"])
def test_scripts_are_whole(tmp_path, to):
    pp.export(block(nu=0.4), to, tmp_path / "m.py", progress=False)
    text = (tmp_path / "m.py").read_text()
    compile(text, "m.py", "exec")
    assert text.startswith("# Palpate model") and "$" not in text


@pytest.mark.slow
@pytest.mark.parametrize(("to", "needs"), [("newton", "newton"), ("drake", "pydrake")])
def test_scripts_press_back_about_as_we_do(tmp_path, to, needs):
    pytest.importorskip(needs)
    model, depth = block(nu=0.4, ball=False), 0.002
    pp.export(model, to, tmp_path / "m.py", depth_m=depth, progress=False)
    said = subprocess.run([sys.executable, tmp_path / "m.py"], capture_output=True, text=True, check=True)
    curve = np.array([line.split() for line in said.stdout.splitlines() if line[:1] in "-0"], dtype=float)
    ours = float(np.abs(pp.press(model, (0, 0, 0.03), (0, 0, -1), depth, progress=False).force[:, 2]).max())
    assert abs(curve[0, 1]) < 0.02 * ours and 0.5 * ours < np.median(curve[-5:, 1]) < 1.5 * ours


def test_stl_is_closed_and_in_the_unit_asked_for(tmp_path):
    pp.export(block(), "stl", tmp_path / "m.stl", unit="mm", progress=False)
    shell = trimesh.load(tmp_path / "m.stl")
    assert shell.is_watertight and shell.volume == pytest.approx(60 * 50 * 30, rel=1e-5)
    assert read_surface(tmp_path / "m.stl", "mm").size_m == pytest.approx(0.06)


def _pressed(path) -> np.ndarray:
    text = tree.parse(path).getroot().find(".//custom/text").get("data")
    return np.fromstring(text, sep=" ")


def flex_forces(path, aside_m: float = 0.0) -> np.ndarray:
    """(2, 3) N on the tip with MuJoCo's own scene: settled where it is pressed, then led aside along x."""
    mujoco = pytest.importorskip("mujoco")
    model = mujoco.MjModel.from_xml_path(str(path))
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    away = _pressed(path) - data.body("tip").xpos
    found = []
    for aim in (away, away + [aside_m, 0, 0]) if aside_m else (away,):
        begun = data.ctrl.copy()
        for k in range(200):
            data.ctrl[:] = begun + (aim - begun) * min(1.0, k / 100)
            mujoco.mj_step(model, data)
        found.append(force_on_tip(mujoco, model, data))
    return np.array(found)


@pytest.mark.slow
@pytest.mark.parametrize("cells", [(8, 7, 5), (12, 10, 6)])
def test_mujoco_runs_the_scene_and_presses_back_alike(tmp_path, cells):
    """Up to nu = 0.45 linear tetrahedra hardly lock; what is left is their coarseness under a narrow tip, and
    that a flex softens under a deep dent."""
    model = block(nu=0.45, ball=False, cells=cells)
    depth = 0.0008
    with contextlib.chdir(tmp_path):  # MuJoCo leaves its warnings in a file where it runs
        pp.export(model, "mujoco", tmp_path / "m.xml", depth_m=depth, progress=False)
        theirs = abs(flex_forces(tmp_path / "m.xml")[0, 2])
    ours = pp.press(model, (0, 0, 0.03), (0, 0, -1), depth, progress=False)
    peak = float(np.abs(ours.force[:, 2]).max())
    assert theirs == pytest.approx(peak, rel=0.1)


@pytest.mark.slow
@pytest.mark.parametrize("mu", [0.2, 2.0])
def test_mujoco_tip_drags_the_surface_along_until_it_slips(tmp_path, mu):
    """Sideways over normal force is by Mindlin and Hertz 3 (1 - nu) / (2 - nu) times way aside over depth
    where the tip holds, 0.42 here; a slippery one stays at its friction."""
    depth, aside = 0.0008, 0.0003
    model = block(nu=0.4, order=1, ball=False, cells=(5, 4, 3))
    model = model.replaced(effects={"friction_slip": {"mu": mu}})
    with contextlib.chdir(tmp_path):
        pp.export(model, "mujoco", tmp_path / "m.xml", depth_m=depth, progress=False)
        still, dragged = flex_forces(tmp_path / "m.xml", aside)
    push, side = dragged[2], -dragged[0]
    assert push > 0.8 * still[2] > 0
    holds = 3 * (1 - 0.4) / (2 - 0.4) * aside / depth
    assert side / push == pytest.approx(min(mu, holds), rel=0.25)


def test_the_command_says_what_is_lost_and_refuses_in_one_line(tmp_path, capsys):
    folder = write_model(tmp_path / "MODEL", block().replaced(effects={"friction_slip": {"mu": 0.3}}))
    out = tmp_path / "m.inp"
    words = ["export", str(folder), "--to", "abaqus", "-o", str(out), "--json", str(tmp_path / "j.json")]
    assert cli.main(words) == 0 and out.stat().st_size > 1000
    assert "next: solve it with Abaqus or CalculiX" in capsys.readouterr().out
    assert "not in the file: friction_slip" in json.loads((tmp_path / "j.json").read_text())["notes"]
    for bad, part in (
        (["--to", "gmsh", "-o", str(out)], "must end in .msh"),
        (["--to", "gmsh", "-o", str(tmp_path / "a.msh"), "--unit", "mm"], "in metres"),
        (["--to", "stl", "-o", str(tmp_path / "a.stl"), "--unit", "feet"], "allowed are m, cm"),
        (["--to", "sofa", "-o", str(tmp_path / "a.scn"), "--depth", "0"], "greater than 0"),
        (["--to", "sofa", "-o", str(tmp_path / "a.scn"), "--depth", "5"], "high: press less deep"),
        (["--to", "abaqus", "-o", str(tmp_path / "a.inp"), "--at", "9,9,9"], "from the object, which is"),
    ):
        capsys.readouterr()
        assert cli.main(["export", str(folder), *bad]) == 2
        line = capsys.readouterr().err.strip()
        assert part in line and len(line.splitlines()) == 1
