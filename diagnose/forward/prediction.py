"""The forward model of a whole recording: settings (ideal until an effect changes them) to every press's
force.

The chain, in the order in which nature and instrument act: surface and handle -> tip path -> contact with the
elastic object -> what follows the path (softening, memory, adhesion) -> what the force sensor reads.
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import ClassVar, Self

import numpy as np

from palpate.diagnosis.forward import kernel
from palpate.diagnosis.forward.touches import place_of
from palpate.mechanics.compliance.pressed_places import Places, solve_places
from palpate.mechanics.contact.dent import bend_of, effective_radius
from palpate.mechanics.contact.touch import TouchedPlaces
from palpate.mechanics.effects.laws_along_path import new_memory, path_numbers
from palpate.mechanics.effects.settings import ForwardSettings, TouchTerms
from palpate.mechanics.effects.skin_layer import EFFECT as SKIN
from palpate.mechanics.effects.skin_layer import beneath_skin
from palpate.mechanics.errors import OptionError
from palpate.mechanics.model.model import Model
from palpate.mechanics.press_solver.press import LAWS
from palpate.mechanics.press_solver.solved_places import ExactPresses, PlacesToSolve, solve_touched
from palpate.mechanics.presses.table import Presses
from palpate.mechanics.progress import Progress, silent
from palpate.mechanics.recording.kinematics import acceleration
from palpate.render.surface.felt_surface import felt_surface

KEPT = 8
"""Integrated touches that are kept."""


@dataclass
class Forward:
    """Presses with the mechanics of their places; `predict(settings)` is the forward model.

    What effects see of it: mechanics.effects.settings.Scene. exact: the places solved, by which the law's
    forces are corrected along the depth.
    """

    touches: Presses
    places: Places
    exact: ExactPresses | None = field(default=None, kw_only=True)
    measured: ClassVar[bool] = True
    """Whether a sensor read the forces; a simulator's modulus and surface are known: no fit moves them."""

    def __post_init__(self) -> None:
        self._kept: dict[int, np.ndarray] = {}
        self._as_read = self.touches

    @cached_property
    def acceleration(self) -> np.ndarray:
        """(n, 3) m/s^2, device frame, press by press from the thinned positions as they were read."""
        t = self._as_read
        return np.concatenate([acceleration(t.t[part], t.position[part]) for part in t.parts])

    def of(self, presses: np.ndarray) -> Self:
        """The same of some presses (p,) bool."""
        exact = None if self.exact is None else self.exact.of(presses)
        return replace(self, touches=self.touches.of(presses), places=self.places.of(presses), exact=exact)

    def law_error(self, usual: float | np.ndarray) -> np.ndarray:
        """(p,) standard error of the law as a share of the force; the usual one where nothing is solved."""
        if self.exact is None:
            return np.broadcast_to(usual, len(self.touches)).astype(float)
        return next(iter(self.exact.factors.values())).law_error(usual)

    @property
    def model(self) -> Model:
        """The model that is compared with."""
        return self.places.model

    @property
    def tip_radius(self) -> float:
        """m, as stated."""
        return self.touches.tip_radius_m

    @property
    def start(self) -> np.ndarray:
        """(p + 1,) rows of each press."""
        return self.touches.starts

    @property
    def t(self) -> np.ndarray:
        """(n,) s."""
        return self.touches.t

    @property
    def press(self) -> np.ndarray:
        """(n,) the press of each sample."""
        return self.touches.press

    @property
    def lead(self) -> np.ndarray:
        """(n, 3) side of the tip in a play that the reading follows (mechanics.recording.side_of_play)."""
        return self.touches.columns["lead"]

    @property
    def unsure(self) -> np.ndarray:
        """(n, 3) standard deviation of that side."""
        known = self.touches.columns.get("unsure")
        return np.zeros_like(self.lead) if known is None else known

    @property
    def quaternion(self) -> np.ndarray | None:
        """(n, 4) tool to device, scalar first, where it is recorded."""
        return self.touches.quaternion

    def ideal(self, modulus: float) -> ForwardSettings:
        """Settings of the ideal model, with what it has under the tips."""
        p, touch = len(self.touches), TouchTerms()
        beneath_skin(touch, self.model)
        return ForwardSettings(
            modulus=modulus,
            nu=self.model.material.poisson_ratio,
            far=self.places.far,
            bracing=self.places.bracing,
            dent_ratio=1 / self.places.softness,
            onset=np.zeros(p),
            stiffness=np.ones(p),
            touch=touch,
        )

    def predict(self, s: ForwardSettings) -> np.ndarray:
        """(n, 3) N on the tool, local frames."""
        t = self.touches
        y = t.travel.copy()
        y[:, 0] += s.onset[t.press]
        for move in s.moves:
            y = move(y)
        f = self._elastic(s, y)
        if s.touch.numbers:
            self._follow(s, y, f)
        return self._read(s, f) if s.readings else f

    def _elastic(self, s: ForwardSettings, y: np.ndarray) -> np.ndarray:
        """(n, 3) N, the touch's own force along the path y; the last few are kept.

        Force goes with the modulus where the spring of the tool is measured in it, so another modulus,
        memory, delay or reading of the same touch costs no new integration.
        """
        t = self.touches
        law = s.touch.law_of_dent(s.nu)
        table, bracing = np.array(law.table), s.bracing + law.braced * self.places.braced
        usual = self.model.material.young_modulus_pa
        compliance = float(s.tool_compliance * s.modulus / usual)
        arrays = (y, s.far, bracing, s.stiffness, s.dent_ratio, table)
        tip = self.tip_radius * s.touch.tip_ratio
        key = hash((tip, s.nu, compliance, s.touch.friction, *(a.tobytes() for a in arrays)))
        f = self._kept.get(key)
        if f is None:
            curvature = np.broadcast_to(np.asarray(self.places.curvature, dtype=float), (len(t),))
            radius, bend = effective_radius(tip, curvature), bend_of(tip, curvature, bracing)
            f = np.zeros_like(y)
            modulus = usual * s.stiffness
            far, mu = np.ascontiguousarray(s.far), float(s.touch.friction)
            touched = (radius, bend, modulus * s.dent_ratio, modulus)
            kernel.integrate(t.starts, y, far, *touched, s.nu, table, compliance, mu, f)
            if self.exact is not None and s.touch.dent_law in self.exact.factors:
                f *= self.exact.factors[s.touch.dent_law].at(t.press, y[:, 0])[:, None]
            if len(self._kept) >= KEPT:
                self._kept.pop(next(iter(self._kept)))
            self._kept[key] = f
        return f * (s.modulus / usual)

    def _follow(self, s: ForwardSettings, y: np.ndarray, f: np.ndarray) -> None:
        """The laws along the path, on f in place. Thinned samples are means over a step."""
        t, path = self.touches, path_numbers(s.touch)
        averaged = kernel.SUB_PLACES if t.block > 1 else 1
        kernel.follow(
            t.starts, t.t, np.ascontiguousarray(y[:, 0]), place_of(t), np.zeros(t.sites), path.numbers,
            path.reach_m[0], averaged, new_memory(path, 1)[0], f,
        )  # fmt: skip

    def _read(self, s: ForwardSettings, f: np.ndarray) -> np.ndarray:
        """(n, 3) N, what the instrument makes of the force; local frames."""
        frame = self.touches.frame[self.touches.press]
        device = np.einsum("nji,nj->ni", frame, f)
        for _, reading in sorted(s.readings, key=lambda each: each[0]):
            device = reading(device)
        return np.einsum("nij,nj->ni", frame, device)


def build_forward(touches: Presses, model: Model) -> Forward:
    """Solve the far field at every press's place (one factorisation, three solves a place)."""
    return Forward(touches, solve_places(model, touches.point, touches.normal, touches.frame))


def solved(forward: Forward, progress: Progress = silent) -> Forward:
    """The same with its touched places solved under every law that a diagnosis weighs. Raises OptionError for
    a model under a skin, which no press is solved with."""
    t, places, model = forward.touches, forward.places, forward.model
    if model.material.skin is not None:
        raise OptionError(f"no press is solved with {SKIN.name}: leave out --exact")
    far = np.einsum("pji,pjk,pkl->pil", places.frame, places.far, places.frame)
    known = TouchedPlaces(t.normal, far, places.curvature, places.bracing, places.braced)
    felt = felt_surface(model)
    exact = solve_touched(
        model.mesh, PlacesToSolve(t.point, place_of(t), t.deepest, known), LAWS, ratio=model.solid_ratio,
        poisson_ratio=model.material.poisson_ratio, young_modulus_pa=model.material.young_modulus_pa,
        tip_radius_m=forward.tip_radius, surface=(felt.points, felt.triangles), progress=progress,
    )  # fmt: skip
    return replace(forward, exact=exact)
