"""The forward model of a whole recording: settings (ideal until an effect changes them) to every press's
force.

The chain, in the order in which nature and instrument act: surface and handle -> tip path -> contact with the
elastic object -> memory of the material -> adhesion -> what the force sensor reads.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numba import njit

from diagnose import kernel
from diagnose.stages import stored
from mechanics.dent import dent_law, effective_radius, grid
from mechanics.model import Model
from mechanics.presses import Presses
from mechanics.sites import touch_sites

STANDARD_GRAVITY = 9.80665
KEPT = 8
"""Integrated touches that are kept."""


@dataclass
class Settings:
    """What the forward model is told; the defaults are the ideal model.

    modulus: Pa. finite_strain: 0 linear dent, 1 neo-Hookean. table_factor: (k, 2) factors on the dent law's
    normal force and sideways stiffness.
    far: (p, 3, 3) local, unit modulus. dent_ratio: (p,) modulus under the tip over the global one.
    onset: (p,) m, how much earlier each press meets the surface. stiffness: (p,) factor. The rest by name.
    """

    modulus: float
    nu: float
    tip_radius: float
    far: np.ndarray
    dent_ratio: np.ndarray
    onset: np.ndarray
    stiffness: np.ndarray
    finite_strain: float = 0.0
    table_factor: np.ndarray | None = None
    tool_give: float = 0.0
    mu: float = -1.0
    backlash: float = 0.0
    g: np.ndarray | None = None
    tau: np.ndarray | None = None
    mullins: tuple[float, float] | None = None
    adhesion: tuple[float, float, float] | None = None
    delay: float = 0.0
    gain: np.ndarray | None = None
    bias: np.ndarray | None = None
    drift: np.ndarray | None = None
    inertia: float = 0.0
    gravity: np.ndarray | None = None

    def scale_table(self, normal: np.ndarray, sideways: np.ndarray) -> None:
        """Multiply the dent law's normal force and sideways stiffness (k,) at `Forward.dents`."""
        own = np.column_stack([normal, sideways])
        self.table_factor = own if self.table_factor is None else self.table_factor * own


@dataclass
class Forward:
    """Presses with the site mechanics of a model; `predict(settings)` is the forward model.

    far: (p, 3, 3) local frames, unit modulus, 1/m. curvature: (p,) 1/m. stages: what effects asked to
    compute.
    """

    touches: Presses
    model: Model
    far: np.ndarray
    curvature: np.ndarray
    nu: float
    tip_radius: float
    stages: dict[str, Any] = field(default_factory=dict)

    def __post_init__(self) -> None:
        self._linear = dent_law("linear").table
        self._deep = dent_law("neo-hookean").table
        t = self.touches
        self._kept: dict[int, np.ndarray] = {}
        self.clock = t.t - t.t[0]
        self.acceleration = _acceleration(t)
        self.dents = grid()
        self.onset = np.zeros(len(t))
        self.centre = t.point.mean(axis=0)
        self.height = float((self.model.support.height(self.model.mesh.points)).max())

    def ideal(self, modulus: float) -> Settings:
        """Settings of the ideal model."""
        p = len(self.touches)
        return Settings(
            modulus=modulus,
            nu=self.nu,
            tip_radius=self.tip_radius,
            far=self.far,
            dent_ratio=np.ones(p),
            onset=self.onset.copy(),
            stiffness=np.ones(p),
        )

    def predict(self, s: Settings) -> np.ndarray:
        """(n, 3) N on the tool, local frames."""
        t = self.touches
        y = t.y.copy()
        y[:, 0] += s.onset[t.press]
        if s.backlash != 0:
            y = self._with_play(y, s.backlash)
        f = self._elastic(s, y)
        if s.mullins is not None:
            f = f * _mullins(t, y[:, 0], f[:, 0], *s.mullins)[:, None]
        if s.g is not None and len(s.g):
            slow = f.copy()
            kernel.relax(t.starts, t.t, f, np.asarray(s.g), np.asarray(s.tau), slow)
            # a surface that comes back more slowly than the tip leaves lets go of it: it cannot pull
            f = np.where(slow[:, :1] > 0, slow, 0.0)
        if s.adhesion is not None:
            pull = np.empty(len(f))
            _pull(t.starts, np.ascontiguousarray(y[:, 0]), *s.adhesion, pull)
            f[:, 0] -= pull
        if s.delay != 0:
            f = _shifted(t, f, s.delay)
        return self._read(s, f)

    def _elastic(self, s: Settings, y: np.ndarray) -> np.ndarray:
        """(n, 3) N, the touch's own force along the path y; the last few are kept.

        Force goes with the modulus where the spring of the tool is measured in it, so another modulus,
        memory, delay or reading of the same touch costs no new integration.
        """
        t = self.touches
        table = self._linear
        if s.finite_strain != 0:
            table = table + s.finite_strain * (self._deep - table)
        if s.table_factor is not None:
            table = table.copy()
            table[:, [0, 2]] *= s.table_factor
        usual = self.model.material.young_modulus_pa
        give = s.tool_give * s.modulus / usual
        arrays = (y, s.far, s.stiffness, s.dent_ratio, table)
        key = hash((s.tip_radius, s.nu, give, s.mu, *(a.tobytes() for a in arrays)))
        f = self._kept.get(key)
        if f is None:
            radius = np.ascontiguousarray(
                np.broadcast_to(effective_radius(s.tip_radius, self.curvature), (len(t),))
            )
            f = np.zeros_like(y)
            modulus = usual * s.stiffness
            far = np.ascontiguousarray(s.far)
            kernel.integrate(
                t.starts, y, far, radius, modulus * s.dent_ratio, modulus, s.nu, table, give, s.mu, f
            )
            if len(self._kept) >= KEPT:
                self._kept.pop(next(iter(self._kept)))
            self._kept[key] = f
        return f * (s.modulus / usual)

    def weight(self, mass_kg: float, share: float) -> np.ndarray:
        """(n, 3) N, device frame: `share` of the tool's weight that a tare has not taken off, along the
        support.

        With the tool's orientation recorded, a tare holds only at the orientation of the start: the rest
        turns.
        """
        t = self.touches
        down = -self.model.support.normal
        weight = mass_kg * STANDARD_GRAVITY * down
        if t.quaternion is None:
            return np.broadcast_to(share * weight, t.f.shape)
        from scipy.spatial.transform import Rotation

        turn = Rotation.from_quat(t.quaternion, scalar_first=True)
        tared = turn.apply(turn[0].inv().apply(weight))
        return weight - (1 - share) * tared

    def _with_play(self, y: np.ndarray, width: float) -> np.ndarray:
        """The tip's path behind a play, by device axes: lagging its reading (width > 0) or ahead (< 0)."""
        t = self.touches
        frame = t.frame[t.press]
        if width < 0:
            # the hand moves the tip and the reading follows once the play is taken up
            return y + 0.5 * width * np.einsum("nij,nj->ni", frame, t.columns["lead"])
        device = np.ascontiguousarray(np.einsum("nij,ni->nj", frame, y))
        played = np.empty_like(device)
        kernel.play(t.starts, device, width, played)
        return np.einsum("nij,nj->ni", frame, played)

    def _read(self, s: Settings, f: np.ndarray) -> np.ndarray:
        if s.gain is None and s.bias is None and s.drift is None and s.inertia == 0 and s.gravity is None:
            return f
        frame = self.touches.frame[self.touches.press]
        device = np.einsum("nji,nj->ni", frame, f)
        if s.inertia != 0:
            device = device + s.inertia * self.acceleration
        if s.gravity is not None:
            device = device + s.gravity
        if s.gain is not None:
            device = device @ s.gain.T
        if s.bias is not None:
            device = device + s.bias
        if s.drift is not None:
            device = device + self.clock[:, None] * s.drift
        return np.einsum("nij,nj->ni", frame, device)


def build_forward(touches: Presses, model: Model, *, solver: Any = None) -> Forward:
    """Solve the far field at every press's place (one factorisation, three solves a place)."""
    unique, first, inverse = places_of(touches)

    def solve() -> dict[str, np.ndarray]:
        ratio = model.element_ratio if np.ptp(model.element_ratio) > 0 else None
        where = (touches.point[first], touches.normal[first])
        sites = touch_sites(
            model.mesh.quadratic(), *where, model.material.poisson_ratio, ratio, solver=solver
        )
        return {"far": sites.far, "curvature": sites.curvature}

    sites = stored("sites", model, touches, solve)
    frame = touches.frame
    far = np.einsum("pij,pjk,plk->pil", frame, sites["far"][inverse], frame)
    return Forward(
        touches,
        model,
        np.ascontiguousarray(far),
        sites["curvature"][inverse],
        model.material.poisson_ratio,
        touches.tip_radius_m,
    )


def places_of(touches: Presses, grain: float = 0.0008) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Presses of nearly the same place and normal share a solve."""
    key = np.round(np.hstack([touches.point / grain, touches.normal / 0.05])).astype(int)
    return np.unique(key, axis=0, return_index=True, return_inverse=True)


def _acceleration(t: Presses) -> np.ndarray:
    """(n, 3) m/s^2, device frame, from the thinned positions, smoothed over three steps."""
    position = t.position
    out = np.zeros_like(position)
    for a, b in zip(t.starts[:-1], t.starts[1:], strict=True):
        x, clock = position[a:b], t.t[a:b]
        step = np.median(np.diff(clock))
        second = np.zeros_like(x)
        second[2:-2] = (x[4:] - 2 * x[2:-2] + x[:-4]) / (4 * step * step)
        out[a:b] = second
    return out


@njit(cache=True)
def _shift_rows(start, t, f, delay, out):  # type: ignore[no-untyped-def]
    for p in range(start.shape[0] - 1):
        a, b = start[p], start[p + 1]
        j = a
        for i in range(a, b):
            wanted = t[i] - delay
            if wanted <= t[a]:
                out[i] = f[a]
                continue
            if wanted >= t[b - 1]:
                out[i] = f[b - 1]
                continue
            while j > a and t[j] > wanted:
                j -= 1
            while t[j + 1] < wanted:
                j += 1
            w = (wanted - t[j]) / (t[j + 1] - t[j])
            out[i] = (1 - w) * f[j] + w * f[j + 1]


def _shifted(t: Presses, f: np.ndarray, delay: float) -> np.ndarray:
    out = np.empty_like(f)
    _shift_rows(t.starts, t.t, f, delay, out)
    return out


@njit(cache=True)
def _pull(start, depth, pull_off, reach, inside, out):  # type: ignore[no-untyped-def]
    """Adhesive pull (n,), N, on the way out only: greatest where the surface is level again, zero at `reach`.

    `inside` of it (0 to 1) already holds deeper in the contact, after a millimetre of the way out. It starts
    and ends so fast that a thinned step is averaged over five places of its path.
    """
    for p in range(start.shape[0] - 1):
        a, b = start[p], start[p + 1]
        deepest = a + np.argmax(depth[a:b])
        for i in range(a, b):
            out[i] = 0.0
        if depth[deepest] <= 0.0:
            continue
        for i in range(deepest + 1, b):
            before = 0.5 * (depth[i] + depth[i - 1])
            after = 0.5 * (depth[i] + depth[min(i + 1, b - 1)])
            for k in range(5):
                share = 0.1 + 0.2 * k
                if share < 0.5:
                    x = before + 2.0 * share * (depth[i] - before)
                else:
                    x = depth[i] + (2.0 * share - 1.0) * (after - depth[i])
                grip = max(1.0 - abs(x) / reach, 0.0)
                if x > 0.0:
                    grip = max(grip, inside * min(max((depth[deepest] - x) / 1e-3, 0.0), 1.0))
                out[i] += 0.2 * pull_off * grip


def _mullins(t: Presses, depth: np.ndarray, force: np.ndarray, r: float, m_rel: float) -> np.ndarray:
    """Softening factor (n,): Ogden and Roxburgh's 1 - erf((W_max - W) / m) / r with W ~ depth^2.5 at the
    site."""
    from scipy.special import erf

    energy = np.clip(depth, 0, None) ** 2.5
    greatest = energy.max() or 1.0
    before = np.zeros(t.sites)
    factor = np.ones(len(depth))
    for p, (a, b) in enumerate(zip(t.starts[:-1], t.starts[1:], strict=True)):
        if t.site[p] < 0:
            continue
        most = np.maximum(np.maximum.accumulate(energy[a:b]), before[t.site[p]])
        factor[a:b] = 1 - erf((most - energy[a:b]) / (m_rel * greatest)) / r
        before[t.site[p]] = most[-1]
    return factor
