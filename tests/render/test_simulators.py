"""Other simulators behind the renderer's interface press a block, each as far as its theory goes."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

import numpy as np
import pytest

from palpate.mechanics.errors import OptionError
from palpate.mechanics.model.material import ObjectMaterial
from palpate.mechanics.model.model import Model, Support, Tool
from palpate.mechanics.progress import silent
from palpate.mechanics.shape.tetmesh import box_mesh
from palpate.render.options import DOCUMENTED, RenderOptions
from palpate.render.press import Stroke, press
from palpate.render.registry import create, names, simulator_names
from palpate.render.replay import replay
from palpate.render.scene import in_the_air
from palpate.render.simulators.base import Adapter, SimulatorRenderer, SteppedWorld

E, NU, RADIUS = 30e3, 0.4, 0.006


@pytest.fixture(scope="module")
def model():
    mesh = box_mesh((8, 8, 4), (0.048, 0.048, 0.024)).quadratic()
    return Model(
        mesh, ObjectMaterial(E, NU), Support(np.zeros(3), np.array([0, 0, 1.0])), Tool(RADIUS), 0.006
    )


def pressed(model, name, **options):
    renderer = create(name, model, RenderOptions(**options))
    stroke = Stroke(0.002, 0.02, hold_s=0.05, approach_m=1e-3, rate_hz=250.0)
    return press(in_the_air(renderer), np.array([0.0, 0.0, 0.024]), np.array([0, 0, -1.0]), stroke)


def test_they_are_named_apart_from_our_own():
    others = set(simulator_names())
    assert others >= {"scikit-fem", "mujoco", "drake", "newton"} and not set(names()) & others


def test_scikit_fem_pushes_back_near_hertz_and_lets_go(model):
    pytest.importorskip("skfem")
    curve = pressed(model, "scikit-fem")
    hertz = 4 / 3 * E / (1 - NU**2) * np.sqrt(RADIUS) * 0.002**1.5
    assert 0.5 * hertz < curve.force_at(0.002)[2] < 2.5 * hertz
    assert curve.force[0] == pytest.approx(0.0) and curve.force[-1] == pytest.approx(0.0, abs=1e-9)
    assert curve.force_at(0.002)[2] > curve.force_at(0.001)[2]


def test_a_softer_penalty_is_a_softer_contact(model):
    pytest.importorskip("skfem")
    soft = pressed(model, "scikit-fem", simulator_set="penalty=0.5")
    assert soft.peak_force_n < 0.8 * pressed(model, "scikit-fem").peak_force_n


def test_a_contact_without_balance_is_an_error_and_no_force(model, monkeypatch):
    pytest.importorskip("skfem")
    monkeypatch.setattr("palpate.render.simulators.scikit_fem.ITERATIONS", 1)
    with pytest.raises(OptionError, match="finds no balance .* lower --simulator-set penalty=10"):
        pressed(model, "scikit-fem")


def test_a_tip_that_sticks_to_mujocos_object_is_pushed_back(model, tmp_path, monkeypatch):
    """Its cones give way where friction is a number as large as ten."""
    pytest.importorskip("mujoco")
    monkeypatch.chdir(tmp_path)
    sticks = pressed(model, "mujoco", friction=np.inf)
    assert sticks.peak_force_n > 0.8 * pressed(model, "mujoco", friction=1.0).peak_force_n


def test_what_mujoco_warns_of_goes_to_the_log_and_into_no_file(model, tmp_path, monkeypatch, caplog):
    """It was printed for each press, and MUJOCO_LOG.TXT stood beside the user's files."""
    mujoco = pytest.importorskip("mujoco")
    monkeypatch.chdir(tmp_path)
    pressed(model, "mujoco")
    scene = mujoco.MjModel.from_xml_string(
        '<mujoco><worldbody><body><freejoint/><geom size="0.01"/></body></worldbody></mujoco>'
    )
    data = mujoco.MjData(scene)
    data.qvel[:] = 1e12
    with caplog.at_level("INFO"):
        mujoco.mj_step(scene, data)
    assert "unstable" in caplog.text and not list(tmp_path.iterdir())


def test_mujoco_pushes_back_and_a_harder_contact_more(model, tmp_path, monkeypatch):
    pytest.importorskip("mujoco")
    monkeypatch.chdir(tmp_path)  # it leaves its warnings in a file where it runs
    plain = pressed(model, "mujoco")
    hard = pressed(model, "mujoco", simulator_set="solref_s=0.004,timestep_s=0.001")
    assert plain.force_at(0.002)[2] > 0 and hard.peak_force_n > 1.2 * plain.peak_force_n


@pytest.mark.parametrize(
    ("name", "needs"),
    [("scikit-fem", "skfem"), ("mujoco", "mujoco"), ("drake", "pydrake"), ("newton", "newton")],
)
def test_a_tip_that_goes_sideways_drags_the_surface_along(model, name, needs, tmp_path, monkeypatch):
    """Near Mindlin's force, on a coarse mesh: to a tip that is put elsewhere without a velocity no friction
    acts."""
    pytest.importorskip(needs)
    monkeypatch.chdir(tmp_path)
    t = np.arange(0.0, 0.09, 0.002)
    down, aside = np.interp(t, [0.0, 0.04], [-5e-4, 2e-3]), np.interp(t, [0.05, 0.08], [0.0, 5e-4])
    tip = np.column_stack([aside, 0 * t, 0.024 + RADIUS - down])
    settings = "edge_radii=inf" + ("" if name == "scikit-fem" else ",timestep_s=0.002")
    options = RenderOptions(friction=1.0, simulator_settings="best", simulator_set=settings)
    renderer = create(name, model, options)
    force = replay(renderer, t, tip, progress=silent)
    before = force[np.searchsorted(t, 0.049)]
    mindlin = 4 * E / (1 + NU) * np.sqrt(RADIUS * 0.002) / (2 - NU) * 5e-4
    assert -3 * mindlin < force[-1][0] - before[0] < -0.3 * mindlin


@pytest.mark.parametrize(("name", "needs"), [("drake", "pydrake"), ("newton", "newton")])
def test_a_simulator_of_steps_pushes_back_along_the_normal_and_lets_go(model, name, needs):
    """Within a factor of three of Hertz at its documented settings, on the model's own coarse mesh."""
    pytest.importorskip(needs)
    curve = pressed(model, name)
    hertz = 4 / 3 * E / (1 - NU**2) * np.sqrt(RADIUS) * 0.002**1.5
    force = curve.force_at(0.002)
    assert 0.5 * hertz < force[2] < 3.5 * hertz and np.abs(force[:2]).max() < 0.1 * force[2]
    assert curve.force[0] == pytest.approx(0.0) and curve.force[-1] == pytest.approx(0.0, abs=1e-9)


def test_a_stepping_simulator_is_led_in_whole_steps_of_its_own():
    class Counted:
        tips, timestep_s = (), 2e-3

        def advance(self, tip, velocity):
            self.tips += (tip[2],)

        def force(self):
            return np.array([0.0, 0.0, len(self.tips)])

    counted = Counted()
    world = SteppedWorld(counted, np.zeros(3))
    assert world.step(1e-3, np.array([0.0, 0.0, 0.1]))[2] == 0  # not a step's time yet
    assert world.step(5e-3, np.array([0.0, 0.0, 0.3]))[2] == 3
    assert counted.tips == pytest.approx((0.1, 0.2, 0.3))


@dataclass(frozen=True)
class Numbers:
    edge_radii: float = 1.0


class Dying(Adapter):
    """A spring until the tip is 1 mm deep, where it does as it is told."""

    name, units, cannot, advice, extra = "dying", "SI", (), {}, "none"
    settings: ClassVar = {DOCUMENTED: Numbers()}
    end = staticmethod(lambda: np.zeros(3))

    def begin(self, tip, radius_m):
        return self

    def step(self, dt_s, tip):
        depth = 0.024 + RADIUS - tip[2]
        return self.end() if depth > 1e-3 else np.array([0.0, 0.0, 1e3 * max(depth, 0.0)])


def crash():
    raise RuntimeError("A mesh field element was degenerate\n  in file mesh.cc")


@pytest.mark.parametrize(
    ("end", "why"),
    [(crash, "element was degenerate: try"), (lambda: np.full(3, np.nan), "its force is no number: try")],
)
def test_what_another_simulator_dies_of_is_said_in_one_line(model, monkeypatch, end, why):
    monkeypatch.setattr(Dying, "end", staticmethod(end))
    renderer = SimulatorRenderer("dying", model, Dying, RenderOptions())
    state = renderer.start()
    tips = [np.array([[0.0, 0.0, 0.024 + RADIUS - depth]]) for depth in (-1e-4, 5e-4, 1.5e-3)]
    forces = [renderer.step(state, tip)[1][0, 2] for tip in tips[:2]]
    assert forces == pytest.approx([0.0, 0.5])
    with pytest.raises(OptionError, match=f"dying ended with the tip at .*{why} .*KEY=VALUE of edge_radii$"):
        renderer.step(state, tips[2])
    assert state.world == [None]


def test_a_setting_that_is_not_there_is_refused(model):
    pytest.importorskip("skfem")
    with pytest.raises(OptionError, match="allowed are edge_radii, order, penalty"):
        create("scikit-fem", model, RenderOptions(simulator_set="colour=3"))
    with pytest.raises(OptionError, match="takes its friction when it is made"):
        create("scikit-fem", model).with_friction(0.3)
