"""Touched places solved instead of tabulated: the solved normal force over the law's, along the depth.

At a place the solver of a press (mechanics.press_solver) presses the model's tip straight in, as deep as it
was pressed, on the surface that is felt; the renderer's law follows the same path. The ratio of the two, a
cubic in depth, is the factor on every force that the law gives there. Solutions are kept by content in the
user's cache.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from palpate.mechanics.effects.adhesion import EFFECT as ADHESION
from palpate.mechanics.effects.compliant_base import EFFECT as YIELDING_BASE
from palpate.mechanics.effects.jkr_adhesion import EFFECT as JKR
from palpate.mechanics.effects.skin_layer import EFFECT as SKIN
from palpate.mechanics.effects.strain_stiffening import EFFECT as STIFFENING
from palpate.mechanics.effects.unbonded_base import EFFECT as UNBONDED
from palpate.mechanics.errors import OptionError
from palpate.mechanics.press_solver.press import PressOptions
from palpate.mechanics.press_solver.solved_places import (
    PlacesLeft,
    SolvedPlace,
    SolvedPresses,
    check_laws,
    felt_of,
)
from palpate.mechanics.presses.table import Presses
from palpate.mechanics.progress import Progress, silent
from palpate.render.base import Renderer
from palpate.render.effects import STICKING, rendered_touch
from palpate.render.fem.renderer import FemRenderer
from palpate.render.force_error import force_errors

UNSOLVED = (ADHESION.name, JKR.name, SKIN.name, YIELDING_BASE.name, UNBONDED.name)
"""Effects of a model that the solver of a press does not know."""


def press_options(renderer: FemRenderer) -> PressOptions:
    """How the solver presses what the renderer renders. Raises OptionError for what it does not know."""
    model, touch = renderer.model, rendered_touch(renderer.model, renderer.options)
    named = [n for n in UNSOLVED if n in model.effects] if renderer.options.effects else []
    named += [SKIN.name] if model.material.skin is not None and SKIN.name not in named else []
    if named:
        raise OptionError(f"no press is solved with {', '.join(named)}: leave out --exact")
    check_laws([touch.dent_law])
    own = model.effects.get(STIFFENING.name, {}) if renderer.options.effects else {}
    stiffening = float(own.get("c20_over_c10", 0.0))
    law = "neo-hookean" if stiffening else touch.dent_law
    friction = None if touch.friction >= STICKING else touch.friction
    return PressOptions(law=law, stiffening=stiffening, coupled=law != "linear", friction=friction)


def check_renderer(name: str) -> None:
    """Raise OptionError for a renderer whose law no press is solved beside."""
    if name != FemRenderer.name:
        raise OptionError(f"--exact solves presses with the law of '{FemRenderer.name}', not of '{name}'")


class ExactPlaces:
    """Solves places of one renderer's model with one tip. Raises OptionError (`press_options`), and for a
    renderer that is not the finite-element one."""

    def __init__(
        self, renderer: Renderer, tip_radius_m: float | None = None, options: PressOptions | None = None
    ) -> None:
        check_renderer(renderer.name)
        assert isinstance(renderer, FemRenderer)
        model, touch = renderer.model, rendered_touch(renderer.model, renderer.options)
        self.renderer, self.tip_m = renderer, float(tip_radius_m or model.tool.tip_radius_m)
        self.options = options or press_options(renderer)
        arrays = renderer.contact.arrays
        surface = felt_of(model.mesh, (arrays.vertices, arrays.triangles))
        self._presses = SolvedPresses(
            model.mesh.linear(), surface, model.solid_ratio, poisson_ratio=model.material.poisson_ratio,
            tip_radius_m=self.tip_m * touch.tip_ratio, options=self.options,
        )  # fmt: skip

    def __call__(
        self, point: np.ndarray, normal: np.ndarray, deepest_m: float, progress: Progress = silent
    ) -> SolvedPlace | None:
        """The place at `point` (3,) m with its outward normal (3,), pressed to `deepest_m`; None where the
        solver finds no equilibrium or the law gives no force."""
        depths = self._presses.depths(deepest_m)
        modulus = self.renderer.model.material.young_modulus_pa
        solved = modulus * self._presses.normal_force(point, normal, depths, progress)
        law, error = self._law(point, normal, depths)
        good = np.isfinite(solved) & (law > 0)
        if good.sum() < 2:
            return None
        return SolvedPlace(
            np.asarray(point), np.asarray(normal), depths[good], law[good], solved[good], error[good]
        )

    def _law(
        self, point: np.ndarray, normal: np.ndarray, depths: np.ndarray
    ) -> tuple[np.ndarray, np.ndarray]:
        """((k,) N, (k,) N): normal force by the law at rest, and what it may be off by."""
        way = np.unique(np.concatenate([np.linspace(-2e-3, depths[-1], 81), depths]))
        path = point + (self.tip_m - way)[:, None] * normal
        state = self.renderer.start([self.tip_m])
        force = self.renderer.follow(state, path[:, None], np.full(len(way), 10.0))[:, 0]
        rows = np.searchsorted(way, depths)
        errors = force_errors(self.renderer, path[rows], force[rows], self.tip_m)
        return force[rows] @ normal, np.zeros(len(rows)) if errors is None else errors.law_n


@dataclass(frozen=True, eq=False)
class ExactReplay:
    """A replayed path with its touched places solved. force_n: (n, 3) N on the tool. places: what was solved.
    unsolved: sites that keep the law, as no equilibrium was found."""

    force_n: np.ndarray
    places: Sequence[SolvedPlace]
    unsolved: int


def exact_replay(
    exact: ExactPlaces,
    presses: Presses,
    sites: Mapping[int, tuple[int, float]],
    t: np.ndarray,
    position: np.ndarray,
    force_n: np.ndarray,
    progress: Progress = silent,
) -> ExactReplay:
    """The law's forces (n, 3) N along a path (n, 3) m at t (n,) s, each press's by its site's solution.

    sites: `mechanics.press_solver.solved_places.deepest_of_sites` of the presses."""
    force, places, unsolved = np.array(force_n), [], 0
    clock = PlacesLeft(len(sites))
    for site, (press, depth) in sites.items():
        progress(*clock.next())
        solved = exact(presses.point[press], presses.normal[press], depth)
        if solved is None:
            unsolved += 1
            continue
        places.append(solved)
        for one in np.flatnonzero(presses.site == site):
            rows = slice(*np.searchsorted(t, [presses.onset_s[one], presses.end_s[one]]))
            centre = presses.point[one] + exact.tip_m * presses.normal[one]
            gone = (centre - position[rows]) @ presses.normal[one]
            force[rows] *= solved.factor(np.maximum(gone, 0.0))[:, None]
    return ExactReplay(force, places, unsolved)
