"""`reconstruct --exact`: the modulus by solved places instead of the tabulated law."""

from __future__ import annotations

import dataclasses
import json

import numpy as np
import pytest

from palpate import cli
from palpate.mechanics.compliance.sites import TouchSites, touch_sites
from palpate.mechanics.contact.depth_factors import DepthFactors
from palpate.mechanics.contact.touch import touch_forces
from palpate.mechanics.errors import OptionError
from palpate.mechanics.press_solver import solved_places
from palpate.mechanics.recording.recording import write_recording
from palpate.reconstruction.methods import BY_NAME, ReconstructOptions
from palpate.reconstruction.steps.s7_modulus.modulus import ModulusOptions, fit_modulus

from .boxes import box
from .exploration_of_cylinder import explore_cylinder
from .test_modulus import FAST, NOISE, NU, PLACES, E, pressed

STIFFER = 1.2


@pytest.fixture(scope="module")
def sites() -> TouchSites:
    mesh = box((0.08, 0.08, 0.04), (4, 4, 2)).quadratic()
    points = np.array([[x, y, 0.04] for x, y in PLACES])
    return touch_sites(mesh, points, np.tile([0.0, 0.0, 1.0], (len(points), 1)), NU, curvature=0.0)


def stiffer(count: int, by: float = STIFFER) -> DepthFactors:
    """Solved places that are stiffer than the law at every depth."""
    depth = np.linspace(1e-3, 6e-3, 6)
    return DepthFactors.fitted(count, {k: (depth, depth, by * depth) for k in range(count)})


def test_the_modulus_is_that_of_the_solved_places_and_surer(sites):
    at = dataclasses.replace(sites, factors=stiffer(len(sites)))
    presses = pressed(at, law="linear")
    by_table = fit_modulus(presses, sites, NOISE, FAST)
    exact = {law: stiffer(len(sites)) for law in ("linear", "neo-hookean")}
    solved = fit_modulus(presses, sites, NOISE, FAST, exact=exact)
    assert by_table.modulus_pa == pytest.approx(STIFFER * E, rel=0.02)
    assert solved.modulus_pa == pytest.approx(E, rel=0.01)
    wide, narrow = (np.log(f.ci95_pa[1] / f.ci95_pa[0]) for f in (by_table, solved))
    assert narrow < 0.7 * wide  # the law's own error is most of it
    assert "solved" in solved.reason and "solved" not in by_table.reason


def test_only_laws_that_were_solved_are_weighed(sites):
    presses = pressed(sites, law="linear")
    fit = fit_modulus(presses, sites, NOISE, FAST, exact={"neo-hookean": stiffer(len(sites), 1.0)})
    assert list(fit.by_law) == ["neo-hookean"]


def test_what_cannot_be_solved_is_refused_before_the_work():
    for method, law in (("paper", "auto"), ("finite-tip", "hertz")):
        options = ReconstructOptions(method=method, modulus=ModulusOptions(law=law, exact=True))
        with pytest.raises(OptionError, match="exact|solved"):
            BY_NAME[method](options)


@pytest.mark.slow
def test_the_command_says_time_and_both_moduli(tmp_path, monkeypatch, capsys):
    monkeypatch.setattr(solved_places.SolvedPresses, "normal_force", _stiffer_than_the_law)
    samples = write_recording(tmp_path / "cylinder.csv", explore_cylinder()[0])
    result = tmp_path / "out.json"
    words = ["--surface", "hull", "--mesh-size", "0.019", "--dent-law", "linear", "--exact"]
    assert (
        cli.main(["reconstruct", str(samples), "-o", str(tmp_path / "M"), *words, "--json", str(result)]) == 0
    )
    out, told = capsys.readouterr().out, json.loads(result.read_text())
    assert "places to solve" in out
    exact = told["exact"]
    assert exact["unsolved_places"] == 0 and {one["dent_law"] for one in exact["places"]} == {"linear"}
    ratio = np.concatenate([np.divide(one["solved_n"], one["law_n"]) for one in exact["places"]])
    # forces are those of a half-space here, which the law of the whole object lies below
    by_table = exact["young_modulus_by_table_pa"]
    assert by_table / ratio.max() < told["young_modulus_pa"] < by_table / ratio.min()


def _stiffer_than_the_law(self, point, normal, depths):
    """As a half-space answers, N over Pa."""
    from palpate.mechanics.contact.touch import TouchedPlaces

    way = np.concatenate([[0.0], depths])
    return touch_forces(
        -way[:, None] * normal, np.array([0, len(way)]), TouchedPlaces(normal[None], np.zeros((1, 3, 3))),
        young_modulus_pa=1.0, poisson_ratio=self.solver.poisson_ratio, tip_radius_m=self.tip_radius_m,
        law="linear",
    )[1:] @ normal  # fmt: skip
