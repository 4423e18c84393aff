"""A model in other programs' files: each read back to the same mesh and moduli; MuJoCo's scene is run."""

from __future__ import annotations

import ast
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
from palpate.exporting.mujoco import FILE_SETTINGS
from palpate.mechanics.disk.surface_files import read_surface
from palpate.mechanics.model.files import write_model
from palpate.mechanics.model.material import Ball, ObjectMaterial
from palpate.mechanics.model.model import Model, Support, Tool
from palpate.mechanics.progress import silent
from palpate.mechanics.shape.tetmesh import box_mesh
from palpate.render.options import BEST, RenderOptions
from palpate.render.registry import create
from palpate.render.replay import replay
from palpate.render.simulators.base import NEAR_M
from palpate.render.simulators.drake import Drake
from palpate.render.simulators.mujoco import force_on_tip
from palpate.render.simulators.newton import Newton

SIZE = (0.06, 0.05, 0.03)
MATERIAL = ("youngsModulus", "poissonsRatio", "density", "dynamicFriction")


def block(nu: float = 0.49, order: int = 2, ball: bool = True, cells=(8, 7, 5)) -> Model:
    mesh = box_mesh(cells, SIZE)
    inside = {"lump": Ball((0.0, 0.0, 0.015), 0.008, 5.0)} if ball else {}
    return Model(
        mesh=mesh if order == 1 else mesh.quadratic(),
        material=ObjectMaterial(15e3, nu, inclusions=inside),
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


def replayed(model: Model, name: str, place, depth: float, dt_s: float, numbers: str = ""):
    """(tips (n, 3) m, forces (n, 3) N) of `palpate replay --renderer`: straight down at a place of a level
    top from where an exported scene begins, then aside."""
    place, up = np.array(place), np.array([0.0, 0.0, 1.0])
    t = dt_s * np.arange(14)
    down = np.interp(t, [0, 8 * dt_s], [-0.8 * NEAR_M, depth])
    aside = np.interp(t, [10 * dt_s, 13 * dt_s], [0.0, 2e-4])
    tips = place + (model.tool.tip_radius_m - down[:, None]) * up + aside[:, None] * [1.0, 0.0, 0.0]
    options = RenderOptions(simulator_settings=BEST, simulator_set=numbers)
    return tips, replay(create(name, model, options), t, tips, progress=silent)


@pytest.mark.parametrize(("to", "kind"), [("newton", Newton), ("drake", Drake)])
def test_a_script_holds_the_scene_that_is_run(tmp_path, to, kind):
    """Its numbers are those that the renderer gives to the same file."""
    model = block(nu=0.4, cells=(4, 4, 3)).replaced(effects={"friction_slip": {"mu": np.inf}})
    pp.export(model, to, tmp_path / "m.py", at=(0, 0, 0.03), progress=False)
    text = (tmp_path / "m.py").read_text()
    assert text.startswith("# Palpate model") and "$" not in text
    body = ast.parse(text).body
    made = next(n for n in body if isinstance(n, ast.Assign) and ast.unparse(n.value).startswith("Scene("))
    found = {k.arg: eval(ast.unparse(k.value), {"np": np, "inf": np.inf}) for k in made.value.keywords}
    run = kind(model, RenderOptions(simulator_settings=BEST), np.inf)
    radius = model.tool.tip_radius_m
    given = run.given(run.mesh_under(np.array([0, 0, 0.03 + radius + 0.8 * NEAR_M]), radius), radius)
    assert found.keys() == given.keys() and len(given["points"]) > len(model.mesh.linear().points)
    assert all(np.array_equal(found[key], value) for key, value in given.items())
    scene = next(n for n in body if isinstance(n, ast.ClassDef) and n.name == "Scene")
    assert {a.arg for a in scene.body[1].args.args + scene.body[1].args.kwonlyargs} == {"self", *given}


@pytest.mark.slow
@pytest.mark.parametrize(("to", "needs"), [("newton", "newton"), ("drake", "pydrake")])
def test_a_script_gives_the_force_that_is_replayed(tmp_path, to, needs):
    """Its path is led along by the test: everything before it is the script's."""
    pytest.importorskip(needs)
    model = block(nu=0.4, ball=False, cells=(4, 4, 3))
    pp.export(model, to, tmp_path / "m.py", at=(0, 0, 0.03), progress=False)
    built, path = (tmp_path / "m.py").read_text().split("last = START")[0], tmp_path / "led.py"
    tips, ours = replayed(model, to, (0, 0, 0.03), 1e-3, 2e-3)
    path.write_text(
        f"{built}\ntips, counts = np.array({tips.tolist()}), [1] + 13 * [2]\nlast = tips[0]\n"
        "for tip, count in zip(tips, counts):\n"
        "    way = (tip - last) / count\n"
        "    for _ in range(count):\n"
        "        last = last + way\n"
        "        touch.advance(last, way / scene.timestep_s)\n"
        "    print('force', *touch.force().tolist())\n"
    )
    said = subprocess.run([sys.executable, path], capture_output=True, text=True, check=True).stdout
    theirs = np.array([line.split()[1:] for line in said.splitlines() if line[:5] == "force"], dtype=float)
    assert np.abs(ours).max() > 0.01
    assert np.abs(theirs - ours).max() < 1e-6 * np.abs(ours).max()


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


@pytest.fixture(scope="module")
def flex(tmp_path_factory):
    """(file, notes) of a block with a lump."""
    path = tmp_path_factory.mktemp("mujoco") / "m.xml"
    return path, pp.export(block(cells=(4, 4, 3)), "mujoco", path, at=(0, 0, 0.03), progress=False)


def test_mujocos_viewer_begins_with_the_whole_object_in_sight_and_in_its_colour(flex):
    """It began so near that half of the object lay outside the picture, grey on black."""
    mujoco = pytest.importorskip("mujoco")
    scene = mujoco.MjModel.from_xml_path(str(flex[0]))
    data, camera = mujoco.MjData(scene), mujoco.MjvCamera()
    mujoco.mj_forward(scene, data)
    mujoco.mjv_defaultFreeCamera(scene, camera)
    turn, tilt = np.radians([camera.azimuth, camera.elevation])
    ahead = np.array([np.cos(tilt) * np.cos(turn), np.cos(tilt) * np.sin(turn), np.sin(tilt)])
    seen = data.flexvert_xpos - (camera.lookat - camera.distance * ahead)
    far = np.linalg.norm(seen, axis=1)
    assert np.degrees(np.arccos(np.minimum(seen @ ahead / far, 1.0))).max() < scene.vis.global_.fovy / 2
    assert ahead[2] < 0 and far.min() > scene.vis.map.znear * scene.stat.extent
    assert scene.flex_rgba[0] == pytest.approx(np.array([0xEA, 0xD7, 0xBF, 255]) / 255, abs=2e-3)


def test_mujocos_tip_is_pressed_by_the_line_that_is_printed(flex):
    """It stood above the object for ever, and how to move it was not said."""
    mujoco = pytest.importorskip("mujoco")
    path, notes = flex
    (told,) = (found for note in notes if (found := re.search(r"`data\.ctrl\[:\] = \[(.*)\]`", note)))
    model = mujoco.MjModel.from_xml_path(str(path))
    data = mujoco.MjData(model)
    data.ctrl[:] = [float(value) for value in told[1].split(", ")]
    for _ in range(200):
        mujoco.mj_step(model, data)
    assert data.body("tip").xpos == pytest.approx(_pressed(path), abs=2e-5)
    assert force_on_tip(mujoco, model, data)[2] > 0.01


def test_how_far_a_flex_is_off_under_a_deep_press_is_told(tmp_path):
    """Pressed as deep as `palpate press` does it read a quarter of its force, and no number was said."""
    mujoco = pytest.importorskip("mujoco")
    path, model = tmp_path / "m.xml", block(nu=0.45, ball=False, cells=(4, 4, 3))
    notes = pp.export(model, "mujoco", path, at=(0, 0, 0.03), progress=False)
    (told,) = (
        found for each in notes if (found := re.search(r"([\d.]+) mm deep .* (\d+) mN .* (\d+) mN", each))
    )
    depth_m, theirs, ours = (1e-3 * float(value) for value in told.groups())
    curve = pp.press(model, at=(0, 0, 0.05), depth_m=depth_m, progress=False)
    assert ours == pytest.approx(curve.peak_force_n, rel=0.05)
    scene = mujoco.MjModel.from_xml_path(str(path))
    data = mujoco.MjData(scene)
    mujoco.mj_forward(scene, data)
    data.ctrl[:] = np.array([0, 0, 0.035 - depth_m]) - data.body("tip").xpos
    for _ in range(300):
        mujoco.mj_step(scene, data)
    assert theirs == pytest.approx(force_on_tip(mujoco, scene, data)[2], rel=0.15) and theirs < 0.8 * ours


def test_mujocos_file_gives_the_force_that_is_replayed(tmp_path):
    """The file, loaded and stepped by MuJoCo alone with its tip led by hand, against the renderer on the same
    path: down and aside, with a Poisson's ratio that a flex does not bear, a friction that never slips and a
    lump that neither holds."""
    mujoco = pytest.importorskip("mujoco")
    model = block(nu=0.49, order=1, cells=(4, 4, 3)).replaced(effects={"friction_slip": {"mu": np.inf}})
    with contextlib.chdir(tmp_path):
        notes = pp.export(model, "mujoco", tmp_path / "m.xml", at=(0, 0, 0.03), progress=False)
        tips, ours = replayed(model, "mujoco", (0, 0, 0.03), 1e-3, 2e-3, FILE_SETTINGS)
        scene = mujoco.MjModel.from_xml_path(str(tmp_path / "m.xml"))
        scene.opt.disableflags |= mujoco.mjtDisableBit.mjDSBL_ACTUATION
        data, theirs = mujoco.MjData(scene), []
        mujoco.mj_forward(scene, data)
        start = data.body("tip").xpos.copy()
        assert start == pytest.approx(tips[0], abs=1e-9)
        last, wrench = tips[0], np.zeros(6)
        for tip, count in zip(tips, [1] + 13 * [2], strict=True):  # replay's first sample is 1 ms long
            way = (tip - last) / count
            for _ in range(count):
                data.qpos[:3], data.qvel[:3] = last - start, way / scene.opt.timestep
                mujoco.mj_step(scene, data)
                last = last + way
            force = np.zeros(3)
            for k in range(data.ncon):
                mujoco.mj_contactForce(scene, data, k, wrench)
                sign = -1.0 if data.contact[k].geom[0] >= 0 else 1.0
                force += sign * (data.contact[k].frame.reshape(3, 3).T @ wrench[:3])
            theirs.append(force)
    assert ours[-1][2] > 0.01 and ours[-1][0] < -1e-3
    assert np.abs(np.array(theirs) - ours).max() < 1e-6 * np.abs(ours).max()
    for part in (
        f"--simulator-set {FILE_SETTINGS}",
        "ratio is 0.45",
        "friction 10, of the model",
        "one modulus",
    ):
        assert any(part in note for note in notes)


@pytest.mark.slow
def test_mujoco_runs_the_scene_and_presses_back_alike(tmp_path):
    """Up to nu = 0.45 linear tetrahedra hardly lock; what is left is their coarseness under a narrow tip, and
    that a flex softens under a deep dent."""
    model = block(nu=0.45, ball=False, cells=(8, 7, 5))
    with contextlib.chdir(tmp_path):  # MuJoCo leaves its warnings in a file where it runs
        pp.export(model, "mujoco", tmp_path / "m.xml", progress=False)  # at the depth that nobody said
        theirs = abs(flex_forces(tmp_path / "m.xml")[0, 2])
    depth = float(0.03 + model.tool.tip_radius_m - _pressed(tmp_path / "m.xml")[2])
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
    assert "next: " in capsys.readouterr().out
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
