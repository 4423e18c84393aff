"""Touched places solved beside a law of the touch, and kept by content in the user's cache."""

from __future__ import annotations

import time
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Any

import numpy as np

from palpate.mechanics.contact.depth_factors import DepthFactors
from palpate.mechanics.contact.touch import TouchedPlaces, touch_forces
from palpate.mechanics.disk.scratch import cache_folder
from palpate.mechanics.disk.store import content_key, load_or_build
from palpate.mechanics.errors import OptionError
from palpate.mechanics.one_thread import one_thread
from palpate.mechanics.press_solver.press import LAWS, PressOptions, PressSolver
from palpate.mechanics.progress import Progress, silent
from palpate.mechanics.shape.refine import refinement_key
from palpate.mechanics.shape.tetmesh import TetMesh

DEPTHS = 6
"""At which a place is solved, evenly to the deepest."""
CPU_S = 10.0
"""A place's under one law on one core of 2025: what is said beforehand."""
MOST_RADII = 2.0
"""Tip radii to which a place is solved; what is deeper, or no press at all, takes the factor from there."""
_LEAST = 1e-4
"""m, of a press that is solved at all."""
_STEPS = 24


@dataclass(frozen=True, eq=False)
class SolvedPlace:
    """One place. point (3,) m, normal (3,) outward; depth_m, law_n, solved_n: (k,) depths, normal force by
    the law and by the solver. error_n: (k,) what the law may be off by (95 %), () where nobody asked. law: of
    the dent, where more than one may be solved."""

    point: np.ndarray
    normal: np.ndarray
    depth_m: np.ndarray
    law_n: np.ndarray
    solved_n: np.ndarray
    error_n: np.ndarray = field(default_factory=lambda: np.zeros(0))
    law: str = ""

    def factor(self, depth_m: np.ndarray) -> np.ndarray:
        """The solved force over the law's, a cubic in depth; beyond the first and the last depth as there."""
        depth = np.asarray(depth_m, dtype=float)
        return self._factors.at(np.zeros(depth.size, dtype=int), depth.ravel()).reshape(depth.shape)

    @cached_property
    def _factors(self) -> DepthFactors:
        return DepthFactors.fitted(1, {0: (self.depth_m, self.law_n, self.solved_n)})

    def as_json(self) -> dict[str, Any]:
        """Plain."""
        plain = {"point_m": self.point, "normal": self.normal, "depth_m": self.depth_m, "law_n": self.law_n,
                 "solved_n": self.solved_n}  # fmt: skip
        if len(self.error_n):
            plain["force_error_n"] = self.error_n
        return {**plain, "dent_law": self.law} if self.law else plain


class SolvedPresses:
    """Straight presses on one object with one tip, for unit modulus; what was solved before is read.

    mesh: linear. surface: (vertices, triangles) of what is felt. ratio: (m,) modulus of each tetrahedron over
    the object's. Raises OptionError for a law that no press is solved under.
    """

    def __init__(
        self,
        mesh: TetMesh,
        surface: tuple[np.ndarray, np.ndarray],
        ratio: np.ndarray,
        *,
        poisson_ratio: float,
        tip_radius_m: float,
        options: PressOptions,
    ) -> None:
        self.tip_radius_m = float(tip_radius_m)
        self._content = (
            "solved place 4", mesh.points, mesh.tetrahedra, mesh.fixed, *surface, ratio, poisson_ratio,
            tip_radius_m, repr(options), *refinement_key(mesh),
        )  # fmt: skip
        self.solver = PressSolver(
            mesh, surface, young_modulus_pa=1.0, poisson_ratio=poisson_ratio, tip_radius_m=tip_radius_m,
            ratio=ratio, options=options,
        )  # fmt: skip

    def depths(self, deepest_m: float) -> np.ndarray:
        """(DEPTHS,) m, at which a place is solved that was pressed so deep."""
        return min(deepest_m, MOST_RADII * self.tip_radius_m) * np.linspace(0.0, 1.0, DEPTHS + 1)[1:]

    @one_thread
    def normal_force(
        self, point: np.ndarray, normal: np.ndarray, depths: np.ndarray, progress: Progress = silent
    ) -> np.ndarray:
        """(k,) N over Pa, at depths (k,) m; nan from the first that finds no equilibrium."""
        key = content_key(*self._content, np.asarray(point), np.asarray(normal), depths)
        path = cache_folder() / "presses" / f"{key[:24]}.bin"

        def solved() -> dict[str, np.ndarray]:
            return {"force": self.solver.press(point, normal, depths, progress=progress).force}

        made = load_or_build(path, key, solved)
        return made["force"] @ normal


def felt_of(
    mesh: TetMesh, surface: tuple[np.ndarray, np.ndarray] | None = None
) -> tuple[np.ndarray, np.ndarray]:
    """(vertices (v, 3) m, triangles (k, 3)) of what a tip feels: the mesh's own shape where it is known, else
    `surface`, else its boundary."""
    if mesh.shape is not None:
        return mesh.shape.vertices, mesh.shape.triangles
    if surface is not None:
        return surface
    linear = mesh.linear()
    used, triangles = np.unique(linear.surface, return_inverse=True)
    return linear.points[used], triangles.reshape(-1, 3)


@dataclass(frozen=True, eq=False)
class ExactPresses:
    """Presses whose places are solved. factors: of every press, in order, by the dent's law. places: what was
    solved, forces for the modulus that was asked with. unsolved: places that keep the law, as no equilibrium
    was found under one of the laws."""

    factors: Mapping[str, DepthFactors]
    places: Sequence[SolvedPlace]
    unsolved: int

    @property
    def solved(self) -> np.ndarray:
        """(p,) bool: presses of places that are solved."""
        return next(iter(self.factors.values())).solved

    @property
    def said(self) -> str:
        """By how much the law was off where presses are deepest, in words."""
        kept = f"; {self.unsolved} places keep the law, as no equilibrium was found" if self.unsolved else ""
        each = []
        for law in self.factors:
            off = [one.solved_n[-1] / one.law_n[-1] - 1 for one in self.places if one.law == law]
            if off:
                each.append(f"{100 * float(np.mean(off)):+.1f} +- {100 * float(np.std(off)):.1f} % by {law}")
        return f"solved over tabulated force at the deepest, {', '.join(each)}{kept}"

    def of(self, presses: np.ndarray) -> ExactPresses:
        """Those of some presses (p,) bool."""
        return replace(self, factors={law: own.of(presses) for law, own in self.factors.items()})

    def as_json(self) -> dict[str, Any]:
        """Plain."""
        return {"unsolved_places": self.unsolved, "places": [one.as_json() for one in self.places]}


@dataclass(frozen=True)
class PlacesToSolve:
    """p presses that are to be solved. points: (p, 3) m, on the surface. site, deepest_m: (p,), the place and
    how deep each was pressed. places: what the law of the touch knows of each."""

    points: np.ndarray
    site: np.ndarray
    deepest_m: np.ndarray
    places: TouchedPlaces


def solve_touched(
    mesh: TetMesh,
    touched: PlacesToSolve,
    laws: Sequence[str],
    *,
    ratio: np.ndarray,
    poisson_ratio: float,
    young_modulus_pa: float,
    tip_radius_m: float,
    surface: tuple[np.ndarray, np.ndarray] | None = None,
    progress: Progress = silent,
) -> ExactPresses:
    """Solve every touched place, as deep as it was pressed, under each of the dent's laws; the tip sticks.

    ratio: (m,) modulus of each tetrahedron of `mesh` over the object's. surface: (vertices, triangles) that
    is felt, where the mesh knows no shape of its own; None: its boundary, whose facets move single places by
    3 %. Raises OptionError for a law that no press is solved under.
    """
    check_laws(laws)
    linear, deepest = mesh.linear(), deepest_of_sites(touched.site, touched.deepest_m)
    surface = felt_of(mesh, surface)
    count, clock = len(touched.site), PlacesLeft(len(deepest) * len(laws))
    by_site: dict[str, dict[int, tuple[np.ndarray, np.ndarray, np.ndarray]]] = {law: {} for law in laws}
    found: list[tuple[SolvedPlace, int]] = []
    for law in laws:
        options = PressOptions(law=law, coupled=law != "linear")
        presses = SolvedPresses(
            linear, surface, ratio, poisson_ratio=poisson_ratio, tip_radius_m=tip_radius_m, options=options
        )
        for press, depth in deepest.values():
            progress(*clock.next())
            one = _solved(presses, touched, press, depth, law)
            if one is None:
                continue
            by_site[law][int(touched.site[press])] = (one.depth_m, one.law_n, one.solved_n)
            scaled = young_modulus_pa * one.law_n, young_modulus_pa * one.solved_n
            place = SolvedPlace(one.point, one.normal, one.depth_m, *scaled, law=law)
            found.append((place, int(touched.site[press])))
    whole = set.intersection(*(set(own) for own in by_site.values()))
    on_solved = [(press, site) for press, site in enumerate(touched.site.tolist()) if site in whole]
    factors = {
        law: DepthFactors.fitted(count, {press: own[site] for press, site in on_solved})
        for law, own in by_site.items()
    }
    places = [one for one, site in found if site in whole]
    return ExactPresses(factors, places, len(deepest) - len(whole))


def _solved(
    presses: SolvedPresses, touched: PlacesToSolve, press: int, deepest_m: float, law: str
) -> SolvedPlace | None:
    """A press's place for unit modulus; None where fewer than two depths are solved."""
    # rounded, so that what a model's files hold is found again
    places, depths = touched.places, presses.depths(round(deepest_m, 6))
    normal = np.round(places.normals[press], 6)
    point = np.round(presses.solver.on_surface(touched.points[press]), 6)
    way = np.unique(np.concatenate([np.linspace(0.0, depths[-1], _STEPS), depths]))
    by_law = touch_forces(
        -way[:, None] * normal, np.array([0, len(way)]), places.of([press]), young_modulus_pa=1.0,
        poisson_ratio=presses.solver.poisson_ratio, tip_radius_m=presses.tip_radius_m, law=law,
    )[np.searchsorted(way, depths)] @ normal  # fmt: skip
    by_solver = presses.normal_force(point, normal, depths)
    good = np.isfinite(by_solver) & (by_law > 0)
    if good.sum() < 2:
        return None
    return SolvedPlace(point, normal, depths[good], by_law[good], by_solver[good])


def check_laws(laws: Sequence[str]) -> None:
    """Raise OptionError for a law of the dent that no press is solved under."""
    for law in laws:
        if law not in LAWS:
            raise OptionError(f"no press is solved under the law '{law}': there are {', '.join(LAWS)}")


def deepest_of_sites(site: np.ndarray, deepest_m: np.ndarray) -> dict[int, tuple[int, float]]:
    """Of each touched site its deepest press and that depth, m; sites that were hardly touched left out.

    site, deepest_m: (p,), of each press."""
    found: dict[int, tuple[int, float]] = {}
    for press, (own, depth) in enumerate(zip(site.tolist(), deepest_m.tolist(), strict=True)):
        if depth > max(_LEAST, found.get(own, (0, 0.0))[1]):
            found[own] = (press, depth)
    return found


class PlacesLeft:
    """What is left while `count` places are solved one after another, in words."""

    def __init__(self, count: int) -> None:
        self._count, self._done, self._begun = count, 0, time.monotonic()

    def next(self) -> tuple[str, float]:
        """Stage and share of a progress, before the next place is solved."""
        done, of = self._done, self._count
        left = (of - done) * ((time.monotonic() - self._begun) / done if done else CPU_S)
        self._done += 1
        return f"place {done + 1} of {of}, about {max(1, round(left / 60))} min", done / of


def said_beforehand(places: int, laws: int = 1) -> str:
    """What solving so many places takes, each under so many laws, in words."""
    seconds = places * laws * CPU_S
    lasts = f"{round(seconds / 60)} min" if seconds >= 90 else f"{round(seconds)} s"
    each = f" under {laws} laws" if laws > 1 else ""
    return f"{places} place{'s' if places != 1 else ''} to solve{each}, about {lasts} of processor time"
