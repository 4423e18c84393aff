"""A simulator's settings are tuned to a force: the search on a simulator of springs, the whole on MuJoCo."""

from __future__ import annotations

import itertools
import json
import math
from dataclasses import dataclass, replace
from importlib import import_module
from typing import ClassVar
from xml.etree import ElementTree

import numpy as np
import pytest

import palpate as pp
from palpate.cli import main
from palpate.diagnosis.other_simulator.runs import Runs, Sums, TruePath
from palpate.diagnosis.other_simulator.tuned import Judged, Moved, tuned
from palpate.diagnosis.other_simulator.tuning import Budget, SettingsSearch, Trial
from palpate.exporting.settings import SUFFIXES
from palpate.mechanics.model.material import ObjectMaterial
from palpate.mechanics.model.model import Model, Support, Tool
from palpate.mechanics.progress import TimeIsUp
from palpate.mechanics.shape.tetmesh import box_mesh
from palpate.render.options import DOCUMENTED, RenderOptions
from palpate.render.registry import adapter_of, simulator_names
from palpate.render.simulators.base import Adapter, SimulatorRenderer
from palpate.render.simulators.tunable import Tunable
from palpate.scenes.conformance.scaled import scaled_body
from palpate.schemas import identity

from ..support.schemas import faults

TOP_M, RADIUS_M = 0.024, 0.006


@dataclass(frozen=True)
class Numbers:
    """stiffness and damping of a spring; what else costs, and does nothing."""

    n_per_m: float = 100.0
    n_s_per_m: float = 1.0
    idle: float = 1.0


class Springs(Adapter):
    """A spring under the tip, and a damper, whose true settings are 300 N/m and 1 N s/m."""

    name, units, cannot, advice, extra = "springs", "SI", (), {}, "none"
    version = "1"
    settings: ClassVar = {DOCUMENTED: Numbers()}
    tunables: ClassVar = (
        Tunable("idle", (0.1, 1.0, 10.0), "idle", ("tunnelling",)),
        Tunable("n_s_per_m", (0.1, 0.3, 1.0, 3.0, 10.0), "c", ("numerical_damping",)),
        Tunable("n_per_m", (10.0, 30.0, 100.0, 400.0, 1600.0), "k", ("contact_stiffness",)),
    )

    def begin(self, tip, radius_m):
        self.deep = 0.0
        return self

    def step(self, dt_s, tip):
        deep = max(TOP_M + RADIUS_M - tip[2], 0.0)
        rate, self.deep = (deep - self.deep) / dt_s, deep
        own = self.own
        return np.array([0.0, 0.0, own.n_per_m * deep + own.n_s_per_m * rate * (deep > 0)])


@pytest.fixture
def springs(monkeypatch):
    monkeypatch.setattr(
        "palpate.diagnosis.other_simulator.runs.create",
        lambda name, model, options, progress, on_demand: SimulatorRenderer(name, model, Springs, options),
    )
    mesh = box_mesh((4, 4, 2), (0.048, 0.048, TOP_M))
    support = Support(np.zeros(3), np.array([0.0, 0.0, 1.0]))
    return Model(mesh, ObjectMaterial(30e3, 0.4), support, Tool(RADIUS_M), 0.012)


def press(model, depth_m, k=300.0, c=1.0):
    t = np.arange(0.0, 0.2, 0.002)
    deep = np.interp(t, [0.0, 0.1, 0.2], [-4e-4, depth_m, -4e-4])
    centre = np.column_stack([0 * t, 0 * t, TOP_M + RADIUS_M - deep])
    in_it = np.maximum(deep, 0.0)
    rate = np.diff(in_it, prepend=0.0) / 0.002
    force = np.column_stack([0 * t, 0 * t, k * in_it + c * rate * (in_it > 0)])
    return TruePath(f"{1e3 * depth_m:g} mm", model, t, centre, t, force, 1e-3)


def search(model, target_n=0.02, **more):
    runs = Runs("springs", RenderOptions())
    start = {"idle": 1.0, "n_s_per_m": 1.0, "n_per_m": 100.0}
    paths = [press(model, d) for d in (0.001, 0.002)]
    return SettingsSearch(
        runs, paths, Springs.tunables, start, target_n=target_n, step_of=lambda values: 1e-3, **more
    )


def test_one_setting_that_is_wrong_is_moved_and_no_other(springs):
    found = search(springs)
    best = found.run()
    assert best.gap_n < 0.02 < found.tried(found.start, None).gap_n
    assert best.values["n_per_m"] == pytest.approx(300.0, rel=0.1)
    assert found.size(best)[0] == 1


def test_what_the_diagnosis_names_is_tried_first(springs):
    plain, told = search(springs), search(springs)
    plain.run()
    told.run(["contact_stiffness"])
    assert len(told.trials) < len(plain.trials)
    assert {t.values["idle"] for t in told.trials.values()} == {1.0}


def test_a_force_that_is_met_already_moves_nothing(springs):
    found = search(springs, target_n=10.0)
    assert found.run().values == found.start and len(found.trials) == 1


def test_two_settings_are_moved_where_one_does_not_meet_the_force(springs):
    found = search(springs)
    found.paths = [press(springs, d, 1600.0, 3.0) for d in (0.001, 0.002)]
    best = found.run()
    assert best.values["n_per_m"] == 1600.0 and best.values["n_s_per_m"] == 3.0
    assert best.values["idle"] == 1.0 and best.gap_n < 1e-9


def held_press(model, k):
    """A press of springs alone with a hold: what damps makes up for its way in, not for its hold."""
    t = np.arange(0.0, 0.2, 0.002)
    deep = np.interp(t, [0.0, 0.1, 0.2], [-4e-4, 0.002, 0.002])
    centre = np.column_stack([0 * t, 0 * t, TOP_M + RADIUS_M - deep])
    force = np.column_stack([0 * t, 0 * t, k * np.maximum(deep, 0.0)])
    return TruePath("hold", model, t, centre, t, force, 1e-3)


def test_a_setting_is_chosen_by_the_course_of_its_force_not_by_what_one_rung_helps(springs):
    """One rung of the spring, of 0.2 %, helps less than one of the damper, which shows on the way in."""
    found = search(springs, target_n=2e-4)
    found.paths = [held_press(springs, 103.0)]
    damper = Tunable("n_s_per_m", (1e-9, 0.13, 1.3), "c", ("numerical_damping",))
    fine = tuple(100.0 * 1.0022**k for k in range(-20, 20))
    spring = Tunable("n_per_m", fine, "k", ("contact_stiffness",), whole=True)
    found.tunables = (Springs.tunables[0], damper, spring)
    found.start = {**found.start, "n_s_per_m": 1e-9}
    rungs = {"n_s_per_m": 0.13, "n_per_m": fine[21]}
    helps = {name: found.tried({**found.start, name: value}, None).gap_n for name, value in rungs.items()}
    assert helps["n_s_per_m"] < helps["n_per_m"]
    best = found.run()
    assert found.size(best)[0] == 1 and best.values["n_per_m"] == pytest.approx(103.0, rel=0.005)
    assert len(found.trials) <= 12


def test_a_rung_to_the_wrong_side_tells_as_much_as_one_to_the_right(springs):
    """Of a spring that is too stiff the rung beside that costs less is a stiffer one: it is ended early."""
    found = search(springs)
    found.start = {**found.start, "n_per_m": 400.0}
    best = found.run(["contact_stiffness"])
    assert best.values["n_per_m"] == pytest.approx(300.0, rel=0.05) and len(found.trials) <= 5
    wrong = next(t for t in found.trials.values() if t.values["n_per_m"] == 1600.0)
    assert not wrong.whole and wrong.sums.count < 100


def test_a_run_ends_once_it_has_missed_more_than_it_may_and_is_run_again_where_it_may_miss_more(springs):
    runs, path = Runs("springs", RenderOptions()), press(springs, 0.002)
    ended = runs.run({"n_per_m": 10.0}, path, most=0.01)
    assert not ended.whole and 0.01 < ended.sums.missed and len(ended.force) < len(path.t)
    assert ended.sums.count == len(ended.rest) == len(ended.force)
    assert float((ended.rest**2).sum()) == pytest.approx(ended.sums.missed)
    assert runs.run({"n_per_m": 10.0}, path, most=0.005) is ended
    whole = runs.run({"n_per_m": 10.0}, path)
    assert whole.whole and whole.sums.missed > ended.sums.missed and whole.sums.count == len(path.t)
    assert runs.run({"n_per_m": 10.0}, path, most=0.01) is whole


class Ringing(Springs):
    """Pulls from 10.5 to 60 N/m, where it rings."""

    def step(self, dt_s, tip):
        return super().step(dt_s, tip) * (-9.0 if 10.5 < self.own.n_per_m < 60.0 else 1.0)


def test_a_setting_is_found_behind_a_rung_at_which_it_rings(springs, monkeypatch):
    """Beside one that takes off 7 % at its end."""
    monkeypatch.setattr(
        "palpate.diagnosis.other_simulator.runs.create",
        lambda name, model, options, progress, on_demand: SimulatorRenderer(name, model, Ringing, options),
    )
    found = search(springs, target_n=1e-3)
    found.paths = [held_press(springs, 100.0)]
    spring = Tunable("n_per_m", (10.0, 30.0, 100.0), "k", ("contact_stiffness",), dear=True)
    damper = Tunable("n_s_per_m", (0.5, 1.0, 3.0), "c", ("numerical_damping",))
    found.tunables, found.start = (damper, spring), {"idle": 1.0, "n_s_per_m": 0.5, "n_per_m": 10.0}
    assert found.run().values["n_per_m"] == 100.0


def test_what_lies_beyond_its_ladder_is_led_back_to_it(springs):
    found = search(springs, target_n=1e-3)
    found.start = {**found.start, "n_s_per_m": 40.0, "n_per_m": 300.0}
    best = found.run()
    assert best.values["n_s_per_m"] == pytest.approx(1.0, rel=0.2) and found.size(best)[0] == 1


def test_a_place_on_the_ladder_is_its_value_again():
    ladder = Tunable("x", (1.0, 2.0, 8.0), "x", ())
    for value in (1.0, 1.5, 2.0, 4.0, 8.0):
        assert ladder.at(ladder.place(value)) == pytest.approx(value)
    assert ladder.place(4.0) == pytest.approx(1.5)
    assert ladder.place(16.0) == pytest.approx(2.5) and ladder.place(0.5) == pytest.approx(-1.0)
    whole = Tunable("x", (1.0, 2.0, math.inf), "x", (), whole=True)
    assert whole.place(math.inf) == 2.0 and whole.at(1.8) == math.inf and whole.place(1.4) == 0.5


def test_trials_end_with_the_time_and_the_best_so_far_is_taken(springs):
    clock = itertools.count()
    found = search(springs, budget=Budget(8.0, now=lambda: float(next(clock))))
    best = found.run()
    assert found.time_is_up and best.whole and best.gap_n <= found.tried(found.start, None).gap_n


def test_what_costs_too_much_is_not_taken(springs):
    found = search(springs, budget=Budget(ms_per_step=5.0))

    def priced(values, rival):
        stiff = values["n_per_m"]
        sums = Sums(missed=abs(math.log(300 / stiff)), count=1, spent_s=stiff / 20, simulated_s=1.0)
        rest = np.array([[0.0, 0.0, math.log(300 / stiff)]])
        trial = Trial(dict(values), sums, True, 1e-3, 0.0, rest)
        found.trials[found._key_of(values)] = trial
        return trial

    found.tried = priced
    best = found.run()
    assert best.ms_per_step <= 5.0 and best.values["n_per_m"] == 100.0
    front = found.front()
    assert [p.ms_per_step for p in front] == sorted(p.ms_per_step for p in front)
    assert any(p.ms_per_step > 5.0 and p.gap_n < best.gap_n for p in front)


def test_the_certificate_is_of_what_was_not_tuned_on(springs):
    runs = Runs("springs", RenderOptions())
    held, unseen = press(springs, 0.0015), replace(press(springs, 0.002, 100.0), name="soft")
    judged = Judged([press(springs, 0.002)], [held], [unseen])
    found = tuned(runs, springs, judged, noise_n=0.02, law_n=0.0, within_s=60.0)
    assert found.gap_after_n < 0.03 < found.gap_before_n
    # the other shape was right before, and a stiffer contact makes it worse: it is said
    assert found.unseen[0].gap_before_n == pytest.approx(0.0, abs=1e-9) and found.worse == ("soft",)
    assert found.modulus_moved == 0.0 and [m.name for m in found.moved] == ["n_per_m"]
    assert isinstance(found, pp.Tuned) and "does not carry over to soft" in str(found)


@pytest.mark.parametrize(("known_to", "farther"), [(60.0, ()), (30.0, ("between",))])
def test_a_shape_is_farther_off_only_where_its_force_is_known_well_enough_to_tell(springs, known_to, farther):
    # 160 N/m, tuned from 100 to 300: forces of 200 N/m and more are nearer to what was tuned
    runs, between = Runs("springs", RenderOptions()), press(springs, 0.002, 160.0, 1.0)
    bound_n = known_to / 160.0 * np.sqrt((between.force**2).sum() / len(between.force))
    between = replace(between, name="between", bound_n=bound_n)
    found = tuned(
        runs, springs, Judged([press(springs, 0.002)], [], [between]), noise_n=0.005, law_n=0.0, within_s=60.0
    )
    assert found.unseen[0].gap_after_n > 2 * found.unseen[0].gap_before_n
    assert found.unseen[0].gap_after_n > bound_n and found.worse == farther


def said(found):
    import_module("palpate.show")  # a result says itself once that is there
    return "\n".join(found.lines())


class Ticking(Springs):
    """Each of its steps takes 10 ms of a clock that starts at 0; ends_at: s, when Ctrl-C comes."""

    clock_s, ends_at, begins_s = 0.0, math.inf, 0.0

    def begin(self, tip, radius_m):
        type(self).clock_s += self.begins_s * (100.0 if self.own.n_per_m > 250.0 else 1.0)
        return super().begin(tip, radius_m)

    def step(self, dt_s, tip):
        type(self).clock_s += 0.01
        if self.clock_s > self.ends_at:
            type(self).ends_at = math.inf
            raise KeyboardInterrupt
        return super().step(dt_s, tip)


@pytest.fixture
def ticking(springs, monkeypatch):
    """Tunes springs within so many seconds of the clock, of which one run along a path takes about one."""
    monkeypatch.setattr(
        "palpate.diagnosis.other_simulator.runs.create",
        lambda name, model, options, progress, on_demand: SimulatorRenderer(name, model, Ticking, options),
    )
    monkeypatch.setattr(Ticking, "clock_s", 0.0)
    monkeypatch.setattr(Ticking, "ends_at", math.inf)

    def run(within_s, ends_at=math.inf):
        Ticking.ends_at = ends_at
        runs = Runs("springs", RenderOptions(), lambda: Ticking.clock_s)
        shapes = [replace(press(springs, 0.002), name=name) for name in ("one", "two")]
        judged = Judged([press(springs, 0.002)], [press(springs, 0.0015)], shapes)
        return tuned(runs, springs, judged, noise_n=1e-6, law_n=0.0, within_s=within_s)

    return run


@pytest.mark.parametrize("within_s", [1.5, 3.0, 6.0, 12.0, 20.0])
def test_the_time_is_kept_with_the_judgement_in_it(ticking, within_s):
    found = ticking(within_s)
    assert Ticking.clock_s <= within_s + 0.2 and found.seconds <= within_s + 0.2
    assert all(math.isnan(s.gap_after_n) == (s.name in found.undone) for s in found.unseen)
    assert all(name in said(found) for name in found.undone)
    if within_s >= 20.0:
        assert found.undone == () and found.moved and found.gap_after_n < 0.2 * found.gap_before_n
    if within_s <= 3.0:
        assert "two" in found.undone


def test_a_solver_that_hears_of_no_time_is_not_begun_late(ticking, monkeypatch):
    """What is nearest takes a second to begin, of which nobody is told; and trials left no time for it."""
    monkeypatch.setattr(Ticking, "begins_s", 0.01)
    monkeypatch.setattr("palpate.diagnosis.other_simulator.tuning.MARGIN", 0.5)
    for within_s in (9.0, 10.0, 11.0, 12.0, 13.0, 14.0):
        Ticking.clock_s = 0.0
        ticking(within_s)
        assert Ticking.clock_s <= within_s + 0.2


def test_what_was_found_until_ctrl_c_is_kept_and_what_is_lacking_said(ticking, tmp_path):
    """In the trials, and in the judgement after them."""
    whole = ticking(20.0)
    last_s, Ticking.clock_s = Ticking.clock_s, 0.0
    for ends_at, lost in ((7.0, {"held-out presses", "one", "two"}), (last_s - 0.5, {"two"})):
        Ticking.clock_s = 0.0
        found = ticking(20.0, ends_at)
        assert found.interrupted is not None and lost <= {*found.undone}
        assert found.fitted_after_n < found.fitted_before_n and "interrupted" in said(found)
        assert found.as_json()["interrupted"]
        written = replace(found, simulator="scikit-fem", began={}, settings=found.settings)
        assert "n_per_m" in written.save(tmp_path / "x.py").read_text()
    assert whole.interrupted is None


@pytest.mark.slow
def test_settings_are_tuned_where_our_ideal_model_took_too_long(springs, bench, monkeypatch):
    """It says only how near to come. A first run compiles it: that took all the time, nothing was tuned."""
    recording, model = bench.record(law="linear")

    def created(name, model, options, progress, on_demand):
        if name == "fem":
            raise TimeIsUp
        return SimulatorRenderer(name, model, Springs, options)

    monkeypatch.setattr("palpate.diagnosis.other_simulator.runs.create", created)
    how = {"renderer": "mujoco", "diagnosed": False, "shapes": False, "progress": False}
    found = pp.tune(recording, model, **how)
    assert found.trials > 1 and found.target_n == pytest.approx(1.05 * found.noise_n)
    assert "an ideal elastic simulation not run in time" in "\n".join(found.lines())
    assert not faults("tune", {"schema": identity("tune"), **found.as_json()})


@pytest.mark.slow
def test_ctrl_c_writes_the_file_before_it_ends_the_program(ticking, bench, tmp_path, monkeypatch):
    """Called from Python: the command says all, writes, and then ends as any that is interrupted."""
    recording, model = bench.record(law="linear")
    file = tmp_path / "settings.xml"
    how = {"renderer": "mujoco", "save": file, "diagnosed": False, "shapes": False, "progress": False}

    def tuned_until(*args, **more):
        Ticking.ends_at = Ticking.clock_s + 0.1
        return tuned(*args, **more)

    monkeypatch.setattr("palpate.diagnosis.other_simulator.tuned.tuned", tuned_until)
    monkeypatch.setattr("palpate.exporting.settings.write_settings", lambda path, found: path.write_text("x"))
    with pytest.raises(KeyboardInterrupt):
        pp.tune(recording, model, **how)
    assert file.read_text() == "x"


def test_what_only_another_modulus_would_hide_is_said(springs):
    """A force half as large again everywhere, which no setting may reach."""
    runs = Runs("springs", RenderOptions())
    path = press(springs, 0.002, 5e5, 0.0)
    found = tuned(runs, springs, Judged([path], [path], []), noise_n=0.01, law_n=0.0, within_s=60.0)
    assert found.fitted_after_n > found.target_n and found.scale > 1.5
    assert found.scaled_n < found.fitted_after_n


def test_a_body_of_the_kit_has_its_force_at_any_modulus_and_tip():
    own, other = scaled_body("dome"), scaled_body("dome", 40e3, 0.005)
    assert other.force == pytest.approx(0.5 * own.force) and other.bound == pytest.approx(0.5 * own.bound)
    assert np.ptp(other.model.mesh.points, axis=0) == pytest.approx(
        0.5 * np.ptp(own.model.mesh.points, axis=0)
    )
    assert (other.t == own.t).all() and other.model.tool.tip_radius_m == 0.005


@pytest.mark.parametrize("name", simulator_names())
def test_what_may_be_tuned_is_a_setting_within_its_rungs(name):
    adapter = adapter_of(name)
    for tunable in adapter.tunables:
        assert tunable.rungs == tuple(sorted(set(tunable.rungs))) and tunable.term
        for settings in adapter.settings.values():
            value = getattr(settings, tunable.name)
            assert tunable.rungs[0] <= value <= tunable.rungs[-1] or not tunable.mends


@pytest.mark.parametrize("name", simulator_names())
def test_settings_are_written_in_that_simulators_own_file(springs, tmp_path, name):
    runs, path = Runs("springs", RenderOptions()), press(springs, 0.002)
    plain = tuned(runs, springs, Judged([path], [path], []), noise_n=10.0, law_n=0.0, within_s=60.0)
    adapter = adapter_of(name)
    began = {t.name: float(getattr(adapter.settings[DOCUMENTED], t.name)) for t in adapter.tunables}
    first = adapter.tunables[0]
    settings = {**began, first.name: first.rungs[1]}
    moved = (Moved(first.name, began[first.name], first.rungs[1], first.term),)
    found = replace(plain, simulator=name, began=began, settings=settings, moved=moved)
    file = tmp_path / f"settings{SUFFIXES[name]}"
    assert found.save(file) == file and found.save(file) == file  # its own kind is replaced
    text = file.read_text()
    written = {
        "mujoco": f'solref="{first.rungs[1]:g} 1"',
        "scikit-fem": f'"{first.name}": {first.rungs[1]!r}',
    }
    assert written.get(name, f"    {first.name}={first.rungs[1]!r},") in text
    if name == "mujoco":
        ElementTree.fromstring(text)
    else:
        compile(text, file.name, "exec")
    with pytest.raises(pp.OptionError, match="must end in"):
        found.save(tmp_path / "settings.txt")
    json.dumps(found.as_json(), allow_nan=False)
    assert not faults("tune", {"schema": identity("tune"), **found.as_json()})


@pytest.mark.parametrize(
    ("words", "why"),
    [
        (["--within", "soon"], "--within is 'soon'"),
        (["--at-most", "5"], "--at-most is '5'"),
        (["-o", "x.py"], "must end in .xml"),
    ],
)
def test_bad_words_are_refused_before_the_work(tmp_path, capsys, words, why):
    base = ["tune", "silicone-1-cylinder", "--renderer", "mujoco"]
    out = [] if "-o" in words else ["-o", str(tmp_path / "x.xml")]
    assert main([*base, *out, *words]) == 2
    assert why in capsys.readouterr().err


@pytest.mark.slow
def test_a_contact_that_is_too_soft_is_tuned_away(tmp_path, monkeypatch):
    """scikit-fem with a hundredth of its penalty, on a coarse block that our own law presses."""
    pytest.importorskip("skfem")
    from benchmarks._adapter_flaws import LAYOUT
    from benchmarks._simulated_flaws import Block, Given

    block = Block(0, LAYOUT)
    force = block.force(Given(poisson=LAYOUT.poisson))
    recording, model = block.measured(np.random.default_rng(0), force)
    settings = {"simulator_settings": "best", "simulator_set": "edge_radii=inf,penalty=0.2"}
    settings |= {"within": "1h", "shapes": False, "progress": False}
    path = tmp_path / "block.py"
    found = pp.tune(recording, model, renderer="scikit-fem", save=path, **settings)
    assert "penalty" in [m.name for m in found.moved] and found.settings["penalty"] > 1.0
    assert found.gap_after_n < 0.5 * found.gap_before_n and found.modulus_moved == 0.0
    assert "penalty" in path.read_text()
    json.dumps(found.as_json(), allow_nan=False)
