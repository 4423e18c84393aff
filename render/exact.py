"""Touched places solved instead of tabulated: the solved normal force over the law's, along the depth.

At a place the solver of a press (mechanics.press_solver) presses the model's tip straight in, as deep as it
was pressed, on the surface that is felt; the renderer's law follows the same path. The ratio of the two, a
cubic in depth, is the factor on every force that the law gives there. Solutions are kept by content in the
user's cache.
"""

from __future__ import annotations

import time
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np

from mechanics.disk.scratch import cache_folder
from mechanics.disk.store import content_key, load_or_build
from mechanics.effects.adhesion import EFFECT as ADHESION
from mechanics.effects.compliant_base import EFFECT as YIELDING_BASE
from mechanics.effects.jkr_adhesion import EFFECT as JKR
from mechanics.effects.skin_layer import EFFECT as SKIN
from mechanics.effects.strain_stiffening import EFFECT as STIFFENING
from mechanics.effects.unbonded_base import EFFECT as UNBONDED
from mechanics.errors import OptionError
from mechanics.press_solver.press import LAWS, PressOptions, PressSolver
from mechanics.presses.table import Presses
from mechanics.progress import Progress, silent
from render.base import Renderer
from render.effects import STICKING, rendered_touch
from render.fem.renderer import FemRenderer
from render.force_error import force_errors

DEPTHS = 6
"""At which a place is solved, evenly to the deepest."""
CPU_S = 10.0
"""A place's on one core of 2025: what is said beforehand."""
MOST_RADII = 2.0
"""Tip radii to which a place is solved; what is deeper, or no press at all, takes the factor from there."""
UNSOLVED = (ADHESION.name, JKR.name, SKIN.name, YIELDING_BASE.name, UNBONDED.name)
"""Effects of a model that the solver of a press does not know."""
_LEAST = 1e-4
"""m, of a press that is solved at all."""


@dataclass(frozen=True, eq=False)
class SolvedPlace:
    """One place. point (3,) m, normal (3,) outward; depth_m, law_n, solved_n, error_n: (k,) depths, normal
    force by the renderer's law, by the solver, and what the law may be off by (95 %)."""

    point: np.ndarray
    normal: np.ndarray
    depth_m: np.ndarray
    law_n: np.ndarray
    solved_n: np.ndarray
    error_n: np.ndarray

    def factor(self, depth_m: np.ndarray) -> np.ndarray:
        """The solved force over the law's, a cubic in depth; beyond the first and the last depth as there."""
        within = np.clip(depth_m, self.depth_m[0], self.depth_m[-1]) / self.depth_m[-1]
        return np.polynomial.polynomial.polyval(within, self._cubic)

    @cached_property
    def _cubic(self) -> np.ndarray:
        """Least squares, weighed by the force."""
        degree = min(3, len(self.depth_m) - 1)
        return np.polynomial.polynomial.polyfit(
            self.depth_m / self.depth_m[-1], self.solved_n / self.law_n, degree, w=self.law_n
        )

    def as_json(self) -> dict[str, Any]:
        """Plain."""
        return {"point_m": self.point, "normal": self.normal, "depth_m": self.depth_m, "law_n": self.law_n,
                "solved_n": self.solved_n, "force_error_n": self.error_n}  # fmt: skip


def press_options(renderer: FemRenderer) -> PressOptions:
    """How the solver presses what the renderer renders. Raises OptionError for what it does not know."""
    model, touch = renderer.model, rendered_touch(renderer.model, renderer.options)
    named = [n for n in UNSOLVED if n in model.effects] if renderer.options.effects else []
    named += [SKIN.name] if model.material.skin is not None and SKIN.name not in named else []
    if named:
        raise OptionError(f"no press is solved with {', '.join(named)}: leave out --exact")
    if touch.dent_law not in LAWS:
        raise OptionError(f"no press is solved under the law '{touch.dent_law}': there are {', '.join(LAWS)}")
    own = model.effects.get(STIFFENING.name, {}) if renderer.options.effects else {}
    stiffening = float(own.get("c20_over_c10", 0.0))
    law = "neo-hookean" if stiffening else touch.dent_law
    friction = None if touch.friction >= STICKING else touch.friction
    return PressOptions(law=law, stiffening=stiffening, coupled=law != "linear", friction=friction)


def check_renderer(name: str) -> None:
    """Raise OptionError for a renderer whose law no press is solved beside."""
    if name != FemRenderer.name:
        raise OptionError(f"--exact solves presses beside the law of '{FemRenderer.name}', not of '{name}'")


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
        arrays, shape = renderer.contact.arrays, model.mesh.shape
        surface = (arrays.vertices, arrays.triangles) if shape is None else (shape.vertices, shape.triangles)
        mesh, ratio = model.mesh.linear(), model.element_ratio
        nu = model.material.poisson_ratio
        self._radius = self.tip_m * touch.tip_ratio
        self._content = (
            "solved place 1", mesh.points, mesh.tetrahedra, mesh.fixed, *surface, ratio, nu, self._radius,
            repr(self.options),
        )  # fmt: skip
        self._solver = PressSolver(
            mesh, surface, young_modulus_pa=1.0, poisson_ratio=nu, tip_radius_m=self._radius, ratio=ratio,
            options=self.options,
        )  # fmt: skip

    def __call__(self, point: np.ndarray, normal: np.ndarray, deepest_m: float) -> SolvedPlace | None:
        """The place at `point` (3,) m with its outward normal (3,), pressed to `deepest_m`; None where the
        solver finds no equilibrium or the law gives no force."""
        depths = min(deepest_m, MOST_RADII * self._radius) * np.linspace(0.0, 1.0, DEPTHS + 1)[1:]
        key = content_key(*self._content, np.asarray(point), np.asarray(normal), depths)
        path = cache_folder() / "presses" / f"{key[:24]}.bin"
        made = load_or_build(path, key, lambda: {"force": self._solver.press(point, normal, depths).force})
        modulus = self.renderer.model.material.young_modulus_pa
        solved, (law, error) = modulus * made["force"] @ normal, self._law(point, normal, depths)
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


def deepest_of_sites(presses: Presses) -> dict[int, tuple[int, float]]:
    """Of each touched site its deepest press and that depth, m; sites that were hardly touched left out."""
    found: dict[int, tuple[int, float]] = {}
    for press, (site, depth) in enumerate(zip(presses.site.tolist(), presses.deepest.tolist(), strict=True)):
        if depth > max(_LEAST, found.get(site, (0, 0.0))[1]):
            found[site] = (press, depth)
    return found


def exact_replay(
    exact: ExactPlaces,
    presses: Presses,
    t: np.ndarray,
    position: np.ndarray,
    force_n: np.ndarray,
    progress: Progress = silent,
) -> ExactReplay:
    """The law's forces (n, 3) N along a path (n, 3) m at t (n,) s, each press's by its site's solution."""
    force, places, unsolved = np.array(force_n), [], 0
    sites, begun = deepest_of_sites(presses), time.monotonic()
    for k, (site, (press, depth)) in enumerate(sites.items()):
        left = (len(sites) - k) * ((time.monotonic() - begun) / k if k else CPU_S)
        progress(f"place {k + 1} of {len(sites)}, about {max(1, round(left / 60))} min", k / len(sites))
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


def said_beforehand(places: int) -> str:
    """What solving so many places takes, in words."""
    minutes = places * CPU_S / 60
    lasts = f"{max(1, round(minutes))} min" if minutes >= 1.5 else f"{round(places * CPU_S)} s"
    return f"{places} place{'s' if places != 1 else ''} to solve, about {lasts} of processor time"
