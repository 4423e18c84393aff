"""The kit's adapters: what they press feels it."""

from __future__ import annotations

import importlib
import sys
import types
from pathlib import Path

import numpy as np
import pytest

from palpate.mechanics.shape.tetmesh import box_mesh
from palpate.operations.conformance import conformance
from palpate.scenes.conformance import cases

ADAPTERS = Path(cases.__file__).parent / "adapters"
PHYSICS = {"young_modulus_pa": 2e4, "poisson_ratio": 0.45, "friction": 0.3, "tip_radius_m": 0.01}
DEEPEST_M, AIR_M = 0.001, 0.005


def test_newton_tells_two_tips_apart(monkeypatch: pytest.MonkeyPatch) -> None:
    """One presses, the other hangs in air beside it: the second feels nothing, the first a push."""
    pytest.importorskip("newton")
    monkeypatch.syspath_prepend(str(ADAPTERS))
    press = importlib.import_module("run_newton").press
    mesh = box_mesh((8, 4, 2), (0.08, 0.04, 0.02))
    body = {"points": mesh.points, "tetrahedra": mesh.tetrahedra, "fixed": np.flatnonzero(mesh.fixed)}
    t = 0.002 * np.arange(21)
    top = mesh.points[:, 2].max() + PHYSICS["tip_radius_m"]
    pressing = np.column_stack([0 * t + 0.02, 0 * t, top - DEEPEST_M * t / t[-1]])
    hanging = np.column_stack([0 * t - 0.02, 0 * t, 0 * t + top + AIR_M])
    force = press(body, PHYSICS, t, np.stack([hanging, pressing], axis=1))
    alone = press(body, PHYSICS, t, pressing[:, None])
    assert not force[:, 0].any()
    assert force[-1, 1, 2] > 0.01
    np.testing.assert_allclose(force[:, 1], alone[:, 0], atol=0.01 * force[-1, 1, 2])


def test_mujoco_presses_the_slab_as_it_is(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    """Through the first press, at 10 mm/s, where inertia does not matter: rms within a tenth of the force.
    With nodes of 0.1 g it was a fourth of it."""
    pytest.importorskip("mujoco")
    monkeypatch.syspath_prepend(str(ADAPTERS))
    monkeypatch.chdir(tmp_path)  # MuJoCo leaves its warnings in a file where it runs
    press = importlib.import_module("run_mujoco").press
    conformance(tmp_path / "kit")
    with np.load(tmp_path / "kit" / "bodies" / "slab.npz") as stored:
        body = {key: stored[key] for key in stored.files}
    tables = (tmp_path / "kit" / folder / "slab.csv" for folder in ("paths", "truth"))
    path, truth = (np.loadtxt(file, delimiter=",", skiprows=1) for file in tables)
    counted = np.flatnonzero(path[:, 0] <= 0.15)
    force = press(body, PHYSICS, path[counted, 0], path[counted][:, None, 1:])[:, 0]
    true = truth[counted, 1:4]
    assert np.linalg.norm(force - true) < 0.1 * np.linalg.norm(true)


class _Sofa(types.ModuleType):
    """Of SofaPython3 what the kit's adapter calls; nothing moves. made: (type, fields) of every component."""

    def __init__(self, points: np.ndarray) -> None:
        super().__init__("Sofa")
        self.points = points
        self.made: list[tuple[str, dict[str, object]]] = []
        self.Core = types.SimpleNamespace(Node=lambda name: self)
        self.Simulation = types.SimpleNamespace(init=lambda root: None, animate=lambda root, dt: None)

    def addChild(self, name: str) -> _Sofa:
        return self

    def addObject(self, kind: str, **fields: object) -> types.SimpleNamespace:
        self.made.append((kind, fields))
        value = types.SimpleNamespace(value=self.points)
        return types.SimpleNamespace(position=value, center=types.SimpleNamespace(value=None))


def test_sofas_scene_says_it_is_untested_and_holds_the_kits_body(monkeypatch: pytest.MonkeyPatch) -> None:
    """SOFA itself is stood in for: what is asked of it, and the sign and place of a sphere's push on nodes
    that stay where they are."""
    mesh = box_mesh((4, 4, 2), (0.04, 0.04, 0.02))
    body = {"points": mesh.points, "tetrahedra": mesh.tetrahedra, "fixed": np.flatnonzero(mesh.fixed)}
    sofa = _Sofa(mesh.points)
    monkeypatch.setitem(sys.modules, "Sofa", sofa)
    monkeypatch.syspath_prepend(str(ADAPTERS))
    module = importlib.import_module("run_sofa")
    assert "UNTESTED" in str(module.__doc__)
    t = np.array([0.0, 0.01])
    top = mesh.points[:, 2].max() + PHYSICS["tip_radius_m"]
    pressing = np.array([[0.0, 0.0, top + AIR_M], [0.0, 0.0, top - DEEPEST_M]])
    hanging = pressing + [0.0, 0.0, 2 * AIR_M]
    force = module.press(body, PHYSICS, t, np.stack([pressing, hanging], axis=1))
    made = dict(sofa.made)
    solid = made["TetrahedronFEMForceField"]
    assert (solid["youngModulus"], solid["poissonRatio"]) == (2e4, 0.45)
    assert made["FixedProjectiveConstraint"]["indices"] == body["fixed"].tolist()
    assert made["MeshMatrixMass"]["totalMass"] == pytest.approx(1000 * 0.04 * 0.04 * 0.02)
    assert not force[0].any() and not force[:, 1].any()
    stiffness = module.PENALTY * PHYSICS["young_modulus_pa"] * PHYSICS["tip_radius_m"]
    np.testing.assert_allclose(force[1, 0], [0, 0, stiffness * DEEPEST_M], atol=1e-9)
