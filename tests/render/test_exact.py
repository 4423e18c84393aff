"""Touched places solved beside the law: the factor along the depth, what is kept, what the commands say."""

from __future__ import annotations

import json
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

import palpate.render.exact
import palpate.show
from palpate.cli import main
from palpate.mechanics.errors import OptionError
from palpate.mechanics.press_solver import solved_places
from palpate.mechanics.press_solver.press import PressOptions
from palpate.mechanics.press_solver.solved_places import SolvedPlace, deepest_of_sites
from palpate.render.exact import ExactPlaces, exact_replay, press_options
from palpate.render.press import Stroke, press, solved

COARSE = PressOptions(law="linear", finest=0.6, growth=1.2, step=0.5)


@pytest.fixture(scope="module")
def kept(tmp_path_factory):
    """Where solutions are kept."""
    return tmp_path_factory.mktemp("solved")


@pytest.fixture
def exact(cylinder_renderer, kept, monkeypatch):
    """Coarse solutions beside the cylinder's law."""
    monkeypatch.setattr(solved_places, "cache_folder", lambda: kept)
    return ExactPlaces(cylinder_renderer, options=COARSE)


def test_a_solved_press_lies_beside_the_law_and_is_kept(cylinder_renderer, exact, monkeypatch):
    curve = press(cylinder_renderer, [0, 0, 0.08], [0, 0, -1], Stroke(2e-3, 0.02))
    by = solved(curve, exact)
    assert by.exact.depth_m[-1] == pytest.approx(2e-3, rel=1e-6)
    np.testing.assert_allclose(by.exact.solved_n, by.exact.law_n, rtol=0.12)  # coarse elements
    assert not np.allclose(by.exact.solved_n, by.exact.law_n, rtol=1e-3)
    at = curve.deepest
    np.testing.assert_allclose(by.force[at], curve.force[at] * by.exact.factor(curve.depth[at]))
    assert by.force[at] @ by.normal == pytest.approx(by.exact.solved_n[-1], rel=0.02)
    said = "\n".join(by.lines())
    assert f"the law's table alone says {by.exact.law_n[-1]:.3g} N" in said
    assert said.count("may be off") == 1  # a third figure of its own definition stood in the table

    def unasked(*_):
        raise AssertionError("solved twice")

    monkeypatch.setattr(exact._presses.solver, "press", unasked)
    again = solved(curve, exact)
    np.testing.assert_array_equal(again.exact.solved_n, by.exact.solved_n)


def a_place(factor: float) -> SolvedPlace:
    depth = np.linspace(1e-3, 4e-3, 4)
    law = np.array([0.1, 0.3, 0.5, 0.8])
    up = np.array([0.0, 0.0, 1.0])
    return SolvedPlace(0.05 * up, up, depth, law, factor * law, 0.03 * law)


def test_the_factor_holds_beyond_what_was_solved():
    place = replace(a_place(1.0), solved_n=np.array([0.11, 0.31, 0.5, 0.76]))
    ends = place.factor(np.array([0.0, 1e-3, 4e-3, 9e-3]))
    assert ends[0] == ends[1] and ends[2] == ends[3]
    np.testing.assert_allclose(ends[1:3], [1.1, 0.95], rtol=1e-6)
    fine = place.factor(np.linspace(0, 4e-3, 400))
    assert np.abs(np.diff(fine)).max() < 2e-3


def test_a_replay_is_corrected_where_it_touches_and_unsolved_sites_keep_the_law():
    t = np.arange(0, 9, 1e-2)
    up = np.array([0.0, 0.0, 1.0])
    depth = np.where(t % 3 > 1, 4e-3, -4e-3)  # three presses of two seconds
    position = (0.05 + 5e-3 - depth)[:, None] * up
    presses = SimpleNamespace(
        site=np.array([0, 1, 0]), deepest=np.array([2e-3, 2e-3, 4e-3]), point=np.tile(0.05 * up, (3, 1)),
        normal=np.tile(up, (3, 1)), onset_s=np.array([1.0, 4.0, 7.0]), end_s=np.array([3.0, 6.0, 8.9]),
    )  # fmt: skip
    asked = []

    class Places:
        tip_m = 5e-3

        def __call__(self, point, normal, deepest_m):
            asked.append(deepest_m)
            return a_place(1.1) if len(asked) == 1 else None

    force = np.ones((len(t), 3))
    sites = deepest_of_sites(presses.site, presses.deepest)
    found = exact_replay(Places(), presses, sites, t, position, force)
    assert found.unsolved == 1 and len(found.places) == 1
    assert asked == [4e-3, 2e-3]  # once a site, at its deepest
    first = ((t >= 1) & (t < 3)) | ((t >= 7) & (t < 8.9))
    np.testing.assert_allclose(found.force_n[first], 1.1, rtol=1e-6)
    np.testing.assert_array_equal(found.force_n[~first], 1.0)


def test_what_the_solver_does_not_know_is_refused(cylinder_renderer):
    sticky = cylinder_renderer.model.replaced(effects={"adhesion": {"pull_off_n": 0.1, "range_m": 1e-4}})
    other = object.__new__(type(cylinder_renderer))
    other.__dict__.update(cylinder_renderer.__dict__)
    other.model = sticky
    with pytest.raises(OptionError, match="adhesion"):
        press_options(other)


@pytest.mark.slow
def test_the_command_says_law_solution_and_bound(block_folder, kept, monkeypatch, capsys, tmp_path):
    monkeypatch.setattr(solved_places, "cache_folder", lambda: kept)
    monkeypatch.setattr(palpate.render.exact, "press_options", lambda renderer: COARSE)
    result = tmp_path / "press.json"
    place = ["press", str(block_folder), "--at", "0,0,0.03", "--depth", "0.002", "--exact"]
    assert main([*place, "--json", str(result)]) == 0
    out = capsys.readouterr().out
    assert "1 place to solve" in out and "solved [N]" in out
    own = json.loads(result.read_text())["exact"]
    assert len(own["depth_m"]) == len(own["law_n"]) == len(own["solved_n"]) == len(own["force_error_n"]) == 6
    assert main([*place, "--renderer", "kelvin-voigt"]) == 2
    assert "'fem'" in capsys.readouterr().err


def test_a_place_says_how_far_it_is_solved(exact):
    """A bar stood at nothing for a minute."""
    told = []
    up = np.array([0.0, 0.0, 1.0])
    exact(np.array([0.005, 0.0, 0.08]), up, 1e-3, lambda stage, share: told.append((stage, share)))
    shares = [share for _, share in told]
    assert len(set(shares)) > 3 and shares == sorted(shares) and 0 <= shares[0] and shares[-1] <= 1
    assert all("1 mm" in stage for stage, _ in told)
