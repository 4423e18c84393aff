"""Guided exploration: goals, gains, rows, the protocol; a whole exploration of a phantom is slow."""

import io
import json
from itertools import pairwise
from types import SimpleNamespace

import numpy as np
import pytest
import trimesh

from palpate.diagnosis.explore.candidates import Known, ReachOptions, after_touch, modulus_after, press_depth
from palpate.diagnosis.explore.explorer import Explorer
from palpate.diagnosis.explore.goals import GoalOptions, GoalState, surface_error
from palpate.diagnosis.explore.segments import Instrument, Segment, join, split
from palpate.mechanics.errors import OptionError, RecordingError
from palpate.reconstruction.steps.s5_mesh.meshing import mesh_surface
from palpate.robot import segment_of, serve

from ...reconstruct.exploration_of_cylinder import explore_cylinder


def test_the_surfaces_error_is_the_quantile_of_a_gaussian():
    assert surface_error(np.full(50, 1e-3), np.ones(50)) == pytest.approx(1.96e-3, rel=1e-3)
    # a tenth of the area is bad: it alone holds the quantile
    mixed = np.r_[np.full(90, 1e-5), np.full(10, 1e-2)]
    assert surface_error(mixed, np.ones(100)) == pytest.approx(0.6745e-2, rel=1e-3)


def test_a_touch_tells_of_its_surroundings_and_not_of_the_far_side():
    vertices = np.column_stack([np.linspace(0, 0.2, 21), np.zeros(21), np.zeros(21)])
    after = after_touch(vertices, np.full(21, 1e-3), 0)
    assert after[0] < 0.25e-3
    assert (np.diff(after) >= 0).all() and after[-1] == pytest.approx(1e-3, rel=1e-3)


def _known(**given):
    """A block of 40 x 40 x 60 mm on the support, of 30 kPa."""
    block = trimesh.creation.box(extents=[0.04, 0.04, 0.06])
    block.apply_translation([0.0, 0.0, 0.03])
    surface = SimpleNamespace(
        vertices=block.vertices, support_point=np.zeros(3), support_normal=np.array([0.0, 0.0, 1.0])
    )
    usual = {
        "surface": surface, "goals": (), "touched": np.zeros((0, 3)), "depths_m": np.zeros(0),
        "here": np.zeros(3), "asked": np.zeros((0, 3)), "modulus_pa": 3e4, "modulus_sd": 0.05,
        "modulus_bias": 0.02, "poisson_ratio": 0.49, "tip_radius_m": 0.005,
    }  # fmt: skip
    return Known(**{**usual, **given})


@pytest.mark.parametrize("nu", [0.0, 0.3, 0.49])
def test_a_press_is_as_deep_as_the_strongest_force_allows_for_the_objects_own_poissons_ratio(nu):
    reach = ReachOptions(deepest_m=0.02, deepest_share=0.9, strongest_n=1.0)
    depth = press_depth(_known(poisson_ratio=nu), np.array([0.0, 0.0, 0.06]), reach)
    hertz = 4 / 3 * 3e4 / (1 - nu**2) * np.sqrt(0.005) * depth**1.5
    assert hertz == pytest.approx(1.0, rel=1e-9)
    # it never goes deeper for it than it may
    light = press_depth(_known(poisson_ratio=nu, modulus_pa=1.0), np.array([0.0, 0.0, 0.06]), reach)
    assert (
        light
        == pytest.approx(0.02)
        == press_depth(_known(modulus_pa=float("nan")), np.array([0.0, 0.0, 0.06]), reach)
    )


def test_a_press_far_from_the_others_and_a_deep_one_tell_more_of_the_modulus():
    touched = np.array([[0.0, 0, 0], [0.005, 0, 0], [0, 0.005, 0]])
    known = _known(touched=touched, depths_m=np.full(3, 0.005), modulus_sd=0.05, modulus_bias=0.02)

    def after(point, depth):
        return modulus_after(known, np.array(point), depth)

    assert after([0.1, 0, 0], 0.005) < after([0.004, 0.004, 0], 0.005) < 0.05
    assert after([0.1, 0, 0], 0.005) < after([0.1, 0, 0], 0.001)
    assert after([0.1, 0, 0], 0.005) > 0.02


def test_goals_are_met_from_above():
    assert GoalState("modulus", 0.04, 0.05).met and GoalState("modulus", 0.04, 0.05).missing == 0
    assert not GoalState("surface", float("inf"), 0.002).met
    with pytest.raises(OptionError, match="--most"):
        GoalOptions(most=2)


def _rows(kind="press", n=400, late=0.0):
    t = late + np.arange(n) / 1000
    return Segment(kind, t, np.zeros((n, 3)) + [0, 0, 0.05], np.zeros((n, 3)))


def test_presses_that_missed_do_not_keep_the_next_one_at_the_same_place():
    """Four presses of air and one of the object: how high it is is known, and its sides are asked for."""
    recording, onsets = explore_cylinder(noise=0.01)
    first, second = np.searchsorted(recording.t, onsets[:2] - 0.3)
    explorer = Explorer(Instrument(recording.tip_radius_m))
    air = slice(first - 400, first)
    kinds = [("trace", slice(0, first)), *[("press", air)] * 4, ("press", slice(first, second))]
    for kind, rows in kinds:
        samples = recording.t[rows], recording.position[rows], recording.force_on_tool[rows]
        explorer.add(Segment(kind, *samples))
    assert explorer.suggest().why.endswith("where its sides and its top are")


def test_segments_are_joined_end_to_end():
    made = join(Instrument(0.005), [_rows("trace", late=7.0), _rows(late=100.0)])
    assert len(made.t) == 800
    np.testing.assert_allclose(np.diff(made.t), 1e-3)
    assert made.boundary_phase == pytest.approx((0.0, 0.399))


@pytest.mark.parametrize(
    ("kind", "change", "word"),
    [
        ("poke", {}, "allowed are"),
        ("press", {"t": np.zeros(400)}, "stands still"),
        ("press", {"force": np.full((400, 3), np.nan)}, "finite"),
        ("press", {"position": np.zeros((399, 3))}, "shape"),
    ],
)
def test_a_segment_that_cannot_be_says_why(kind, change, word):
    good = _rows()
    with pytest.raises(RecordingError, match=word):
        Segment(kind, **{"t": good.t, "position": good.position, "force": good.force, **change})


def test_a_robot_is_told_to_trace_first_and_its_bad_lines_keep_nothing():
    explorer, said, kept = Explorer(Instrument(0.005)), [], []
    lines = ["no json\n", '{"segment": "press"}\n', "[1]\n", '{"end": true}\n', '{"segment": "press"}\n']
    serve(explorer, io.StringIO("".join(lines)), said.append, kept.append)
    first, *errors = map(json.loads, said)
    assert first["suggest"]["kind"] == "trace" and first["suggest"]["why"]
    assert first["state"]["young_modulus_pa"] is None and not first["state"]["done"]
    assert len(errors) == 3 and all("error" in e for e in errors)
    assert not explorer.segments and not kept


def test_tracings_that_are_never_understood_end_as_presses_do():
    explorer = Explorer(Instrument(0.005), GoalOptions(most=4))
    t = np.arange(3000) / 1000
    air = 0.01 * np.random.default_rng(0).normal(size=(len(t), 3))
    for _ in range(4):
        assert explorer.suggest().kind == "trace"
        explorer.add(Segment("trace", t, np.column_stack([0.05 * np.sin(t), 0 * t, 0.1 + 0 * t]), air))
    told = explorer.suggest()
    assert told.kind == "stop" and explorer.state.trouble in told.why


def test_where_the_air_hides_the_presses_it_is_asked_to_be_shown_and_what_is_shown_is_no_press():
    recording, onsets = explore_cylinder(noise=0.01)
    after = recording.t > recording.boundary_phase[1]
    force = np.where(after[:, None], 0.043, 1.0) * recording.force_on_tool
    force += 0.02 * np.random.default_rng(0).normal(size=force.shape)
    cuts = [0, *np.searchsorted(recording.t, onsets - 0.3), len(force)]
    explorer = Explorer(Instrument(recording.tip_radius_m))
    for k, (a, b) in enumerate(pairwise(cuts)):
        rows = recording.t[a:b], recording.position[a:b], force[a:b]
        explorer.segments.append(Segment("press" if k else "trace", *rows))
    explorer.bring_up_to_date()
    told = explorer.suggest()
    assert told.kind == "free" and explorer.state.trouble in told.why
    t = np.arange(3000) / 1000
    waved = recording.position[-1] + 0.02 * np.column_stack(
        [np.sin(5 * t), np.cos(4 * t) - 1, 1 - np.cos(3 * t)]
    )
    explorer.add(Segment("free", t, waved, 0.02 * np.random.default_rng(1).normal(size=waved.shape)))
    assert explorer.suggest().kind != "free"  # it is asked for once
    assert len(onsets) == explorer.state.made == sum(s.kind == "press" for s in explorer.segments)


def test_a_line_is_a_segment():
    rows = _rows()
    line = json.dumps({"segment": "press", "t": rows.t.tolist(), "position": rows.position.tolist(),
                       "force": rows.force.tolist()})  # fmt: skip
    made = segment_of(line)
    assert made is not None and made.kind == "press" and len(made.t) == 400


@pytest.mark.release
def test_a_phantom_is_explored_by_the_command_until_its_goals_are_met(tmp_path, capsys):
    from palpate import cli

    recording, figures = tmp_path / "rec.csv.gz", tmp_path / "out.json"
    words = ["--phantom", "cylinder", "--modulus", "30000", "--modulus-within", "0.08", "--most", "10"]
    assert cli.main(["explore", *words, "-o", str(recording), "--json", str(figures)]) == 0
    result = json.loads(figures.read_text())
    assert result["done"] and result["made"] <= 10
    low, high = result["young_modulus_ci95_pa"]
    assert low < 30000 < high
    assert result["young_modulus_pa"] == pytest.approx(30000, rel=0.1)
    assert all(step["suggest"]["why"] for step in result["steps"])
    # what was written is a recording like any other
    assert cli.main(["reconstruct", str(recording), "-o", str(tmp_path / "MODEL")]) == 0


@pytest.mark.release
def test_the_robots_example_runs_against_the_laboratory(tmp_path):
    import importlib.util
    from pathlib import Path

    path = Path(__file__).parents[3] / "examples" / "robot_client.py"
    spec = importlib.util.spec_from_file_location("robot_client", path)
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    state = module.main(str(tmp_path / "rec.csv.gz"), most=6)
    assert state["presses"] >= 4 and np.isfinite(state["young_modulus_pa"])
    assert (tmp_path / "rec.csv.gz").exists()


def test_a_place_that_was_asked_for_and_not_reached_is_not_asked_for_again():
    from palpate.diagnosis.explore.candidates import _not_in_vain

    vertices = np.column_stack([np.linspace(0, 0.1, 11), np.zeros(11), np.zeros(11)])
    rows = np.arange(11)
    asked = np.array([[0.05, 0.0, 0.0]])
    reached = _not_in_vain(vertices, rows, np.array([[0.052, 0.0, 0.0]]), asked)
    np.testing.assert_array_equal(reached, rows)
    left = _not_in_vain(vertices, rows, np.array([[0.09, 0.0, 0.0]]), asked)
    assert 5 not in left and len(left) == 10


def test_touches_that_were_off_widen_what_a_surface_says_of_itself():
    explorer = Explorer(Instrument(0.005))
    assert explorer._doubt == 1.0
    explorer._tests = [0.3, 0.5]
    assert explorer._doubt == 1.0
    explorer._tests = [8.0]
    assert explorer._doubt > 3


@pytest.mark.slow
def test_an_exploration_goes_on_as_sure_as_it_ended(monkeypatch):
    """What its last touches said of the surface was forgotten: it went on surer than it had stopped."""
    meshed: dict[bytes, object] = {}

    def once(surface, options):
        # each mesh of one surface moves an end of so wide an interval by a twentieth
        key = surface.vertices.tobytes()
        if key not in meshed:
            meshed[key] = mesh_surface(surface, options)
        return meshed[key]

    monkeypatch.setattr("palpate.diagnosis.explore.estimate.mesh_surface", once)
    instrument, segments = split(explore_cylinder()[0])
    explorer = Explorer(instrument)
    for segment in segments[:7]:
        explorer.add(segment)
    ended, goes_on = explorer.state, Explorer.going_on(explorer.recording).state
    assert goes_on.presses == ended.presses and explorer._tests
    assert goes_on.surface_error_m == pytest.approx(ended.surface_error_m, rel=1e-3)
    np.testing.assert_allclose(goes_on.modulus_ci95_pa, ended.modulus_ci95_pa, rtol=0.05)


def test_a_robot_in_the_laboratory_presses_as_fast_and_as_long_as_it_is_told():
    from palpate.scenes.laboratory.hand import HandOptions
    from palpate.scenes.laboratory.hand_path import _one_touch
    from palpate.scenes.laboratory.paths import WAY_IN
    from palpate.scenes.laboratory.presses import PlannedTouch
    from palpate.scenes.laboratory.surface import TriangleSurface
    from palpate.scenes.phantoms import phantom

    block = phantom("block")
    surface = TriangleSurface(1e3 * block.vertices, block.faces)
    top = np.array([0.0, 0.0, 1e3 * block.height_m])

    def made(**given):
        touch = PlannedTouch(
            0, top, np.array([0.0, 0, 1]), "press", 5.0, np.array([0.0, 0, -1]), np.zeros(3), **given
        )
        return _one_touch(0, touch, surface, HandOptions(), 5.0, np.random.default_rng(3))[0]

    def seconds(samples, low, high):
        inside = (samples["leg"] == WAY_IN) & (samples["s"] > low) & (samples["s"] < high)
        return inside.sum() / 1000

    slow, fast = made(speed=5.0, hold=0.1), made(speed=80.0, hold=0.1)
    assert seconds(slow, 0.0, 4.0) > 8 * seconds(fast, 0.0, 4.0)
    assert seconds(made(speed=80.0, hold=1.5), 4.5, 5.1) - seconds(fast, 4.5, 5.1) == pytest.approx(
        1.4, abs=0.05
    )
