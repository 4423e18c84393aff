"""A pressed block by our own law, and flaws of simulators planted in its forces.

The flaws share no code with those that the diagnosis fits, and are of richer forms: a contact that gives
along the normal alone and stiffens, nodes of a lattice that are touched one after another, a held step,
filtered damping, bursts without contact.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy.signal import lfilter

from palpate.mechanics.compliance.sites import touch_sites
from palpate.mechanics.contact.touch import forces_at
from palpate.mechanics.model.material import ObjectMaterial
from palpate.mechanics.model.model import Model, Support, Tool
from palpate.mechanics.presses.segmentation import FoundPresses, segment_recording
from palpate.mechanics.recording.recording import Recording
from palpate.mechanics.shape.tetmesh import box_mesh

MODULUS_PA, POISSON, RADIUS_M, NOISE_N, RATE_HZ = 20e3, 0.49, 0.005, 0.008, 500.0
SIZE_M = (0.08, 0.08, 0.04)


@dataclass(frozen=True)
class Layout:
    """A block and where and how it is pressed, twice a place. size_m: of its sides. top, side: (x, y) m on
    its top, (y, z) m on its wall at +x. across_m: sideways at the greatest depth. rest_s: in air, before and
    after."""

    size_m: tuple[float, float, float] = SIZE_M
    top: tuple[tuple[float, float], ...] = tuple(
        (x, y) for x in (-0.022, 0.0, 0.022) for y in (-0.022, 0.0, 0.022)
    )
    side: tuple[tuple[float, float], ...] = ((-0.018, 0.02), (0.0, 0.026), (0.018, 0.014), (0.004, 0.012))
    depths_m: tuple[float, ...] = (0.0022, 0.0032, 0.0042)
    speeds_m_per_s: tuple[float, ...] = (0.006, 0.02, 0.06)
    holds_s: tuple[float, ...] = (0.1, 0.5)
    across_m: float = 0.0008
    rest_s: tuple[float, float] = (0.5, 0.4)
    poisson: float = POISSON


@dataclass(frozen=True)
class Press:
    """place: its number. rows: of the recording. into: (n,) m below the surface. across: (n,) m sideways."""

    place: int
    rows: slice
    into: np.ndarray
    across: np.ndarray


@dataclass(frozen=True)
class Given:
    """What a simulation of the block is given."""

    modulus_pa: float = MODULUS_PA
    poisson: float = POISSON
    friction: float = np.inf
    radius_m: float = RADIUS_M


class Block:
    """The block, its presses, and the force of our law along them."""

    def __init__(self, seed: int = 0, layout: Layout = Layout()) -> None:
        rng = np.random.default_rng(seed)
        self.layout, size = layout, layout.size_m
        self.mesh = box_mesh((6, 6, 4), size).quadratic()
        top = [(x, y, size[2]) for x, y in layout.top]
        side = [(size[0] / 2, y, z) for y, z in layout.side]
        self.points = np.array(top + side)
        self.normals = np.array([[0, 0, 1.0]] * len(top) + [[1.0, 0, 0]] * len(side))
        self.presses, self.t, self.centre = self._explored(rng)
        self._sites: dict[float, Any] = {}

    def _explored(self, rng: np.random.Generator) -> tuple[list[Press], np.ndarray, np.ndarray]:
        presses, times, centres, clock, row = [], [], [], 0.0, 0
        plan, (before, after) = self.layout, self.layout.rest_s
        order = [int(i) for _ in range(2) for i in rng.permutation(len(self.points))]
        for number, place in enumerate(order):
            depth = plan.depths_m[(number * 7) % len(plan.depths_m)]
            speed = plan.speeds_m_per_s[number % len(plan.speeds_m_per_s)]
            hold, ramp = plan.holds_s[number % len(plan.holds_s)], depth / speed
            local = np.arange(0.0, before + 2 * ramp + hold + after, 1 / RATE_HZ)
            knots = np.cumsum([0.0, before, ramp, hold, ramp, after])
            into = np.interp(local, knots, [-before * speed, 0.0, depth, depth, 0.0, -after * speed])
            across = plan.across_m * np.clip(into / depth, 0, 1) * (1 if number % 2 else -1)
            n = self.normals[place]
            centres.append(
                self.points[place] + (RADIUS_M - into[:, None]) * n + across[:, None] * [0.0, 1.0, 0.0]
            )
            times.append(clock + local)
            presses.append(Press(place, slice(row, row + len(local)), into, across))
            clock, row = clock + local[-1] + 1 / RATE_HZ, row + len(local)
        return presses, np.concatenate(times), np.concatenate(centres)

    def sites(self, poisson: float) -> Any:
        """Their far field, solved once for a Poisson's ratio."""
        if poisson not in self._sites:
            self._sites[poisson] = touch_sites(self.mesh, self.points, self.normals, poisson)
        return self._sites[poisson]

    def force(
        self,
        given: Given = Given(),
        *,
        law: str = "linear",
        offset: Callable[[Press], float | np.ndarray] = lambda press: 0.0,
        stiffer: Callable[[Press], float] = lambda press: 1.0,
    ) -> np.ndarray:
        """(n, 3) N on the tool. offset: m by which a press goes deeper; stiffer: factor on its force."""
        sites, out = self.sites(given.poisson), np.zeros((len(self.t), 3))
        for press in self.presses:
            into = press.into + offset(press) + (given.radius_m - RADIUS_M)
            n = self.normals[press.place]
            d = -into[:, None] * n + press.across[:, None] * [0.0, 1.0, 0.0]
            own = sites.of(slice(press.place, press.place + 1))
            f = stiffer(press) * forces_at(
                own, d, np.array([0, len(d)]), young_modulus_pa=given.modulus_pa,
                tip_radius_m=given.radius_m, law=law,
            )  # fmt: skip
            if np.isfinite(given.friction):
                push = f @ n
                side = f - push[:, None] * n
                size = np.linalg.norm(side, axis=1)
                f = (
                    push[:, None] * n
                    + side * np.minimum(1.0, given.friction * push / np.maximum(size, 1e-12))[:, None]
                )
            out[press.rows] = f
        return out

    def measured(self, rng: np.random.Generator, force: np.ndarray) -> tuple[Recording, Model]:
        """The block as it was recorded, and its model."""
        recording = Recording(
            t=self.t, position=self.centre, force_on_tool=force + rng.normal(0, NOISE_N, force.shape),
            sample_rate_hz=RATE_HZ, tip_radius_m=RADIUS_M, poisson_ratio=self.layout.poisson,
        )  # fmt: skip
        place = np.array([p.place for p in self.presses])
        onset = np.array([self.t[p.rows][np.argmax(p.into > 0)] for p in self.presses])
        peak = np.array([self.t[p.rows][np.argmax(p.into)] for p in self.presses])
        normal = self.normals[place]
        table = segment_recording(
            recording, FoundPresses(onset, peak, self.points[place] + RADIUS_M * normal, normal)
        )
        model = Model(
            self.mesh, ObjectMaterial(MODULUS_PA, self.layout.poisson),
            Support(np.zeros(3), np.array([0, 0, 1.0])),
            Tool(RADIUS_M), mesh_size_m=self.layout.size_m[0] / 6, presses=table,
        )  # fmt: skip
        return recording, model


@dataclass(frozen=True)
class Flaw:
    """name: of the numerical effect or stated parameter. strengths: least and greatest, drawn by logarithm.
    plant(block, force, strength, rng): the force with it. given(strength): fields of what the simulation was
    given, so that two stand beside each other."""

    name: str
    strengths: tuple[float, float]
    plant: Callable[[Block, np.ndarray, float, np.random.Generator], np.ndarray] | None = None
    given: Callable[[float], dict[str, float]] | None = None


def _each(block: Block, force: np.ndarray, change: Callable[[Press, np.ndarray], np.ndarray]) -> np.ndarray:
    """change(press, (n,) N along the normal) -> the same changed; the sideways force goes along with it."""
    out = force.copy()
    for press in block.presses:
        n = block.normals[press.place]
        push = force[press.rows] @ n
        now = change(press, push)
        kept = np.where(push > 1e-9, now / np.maximum(push, 1e-9), 0.0)
        side = force[press.rows] - push[:, None] * n
        out[press.rows] = now[:, None] * n + side * kept[:, None]
    return out


def _curve(press: Press, push: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """(depth, force) of the way in, increasing."""
    end = int(np.argmax(press.into)) + 1
    depth, force = press.into[:end], np.maximum.accumulate(push[:end])
    keep = np.append(True, np.diff(depth) > 1e-12)
    return depth[keep], force[keep]


def soft_contact(block: Block, force: np.ndarray, stiffness: float, rng: np.random.Generator) -> np.ndarray:
    """A penalty along the normal that is a fifth stiffer once it is a millimetre in."""

    def change(press: Press, push: np.ndarray) -> np.ndarray:
        depth, curve = _curve(press, push)
        sunk = curve / stiffness
        sunk = sunk / (1 + 0.2 * np.minimum(sunk / 1e-3, 1.0))
        return np.interp(press.into, depth + sunk, curve, left=0.0)

    return _each(block, force, change)


def few_nodes(block: Block, force: np.ndarray, spacing: float, rng: np.random.Generator) -> np.ndarray:
    """Nodes of a hexagonal lattice in a half-space, touched one by one; each a patch of 0.4 spacings."""
    plane = MODULUS_PA / (1 - POISSON**2)
    grid = np.array([(i + 0.5 * j, j * np.sqrt(0.75)) for i in range(-4, 5) for j in range(-4, 5)]) * spacing
    tables = {}
    for place in range(len(block.points)):
        nodes = grid + rng.uniform(-0.5, 0.5, 2) * spacing
        nodes = nodes[np.argsort((nodes**2).sum(axis=1))[:14]]
        gap = (nodes**2).sum(axis=1) / (2 * RADIUS_M)
        apart = np.linalg.norm(nodes[:, None] - nodes[None], axis=2)
        compliance = 1 / (np.pi * plane * np.where(apart > 0, apart, 1.0))
        np.fill_diagonal(compliance, 1 / (2 * plane * 0.4 * spacing))
        depths = np.linspace(0, 0.0045, 90)
        pushes = []
        for depth in depths:
            touching = depth > gap
            for _ in range(14):
                if not touching.any():
                    break
                own = np.linalg.solve(compliance[np.ix_(touching, touching)], (depth - gap)[touching])
                if (own >= 0).all():
                    break
                touching[np.flatnonzero(touching)[own < 0]] = False
            pushes.append(float(own.sum()) if touching.any() else 0.0)
        tables[place] = depths, np.maximum.accumulate(pushes)
    sites = block.sites(POISSON)

    def change(press: Press, push: np.ndarray) -> np.ndarray:
        n = block.normals[press.place]
        far = float(n @ sites.far[press.place] @ n) / MODULUS_PA
        depths, pushes = tables[press.place]
        total = depths + far * pushes
        return np.interp(press.into, total, pushes, left=0.0)

    return _each(block, force, change)


def stiff_mesh(block: Block, force: np.ndarray, ratio: float, rng: np.random.Generator) -> np.ndarray:
    """Stiffer, and the more so the nearer the base; each place a little differently."""
    own = rng.normal(0, 0.02, len(block.points))
    low = 1 - block.points[:, 2] / SIZE_M[2]
    factor = ratio ** (1 + 0.5 * low) * np.exp(own)
    return _each(block, force, lambda press, push: push * factor[press.place])


def damping(block: Block, force: np.ndarray, damping: float, rng: np.random.Generator) -> np.ndarray:
    """A dashpot whose speed is filtered over 5 ms; nothing pulls."""

    def change(press: Press, push: np.ndarray) -> np.ndarray:
        speed = np.gradient(press.into, 1 / RATE_HZ)
        share = 1 / (1 + 0.005 * RATE_HZ)
        slow = lfilter([share], [1, share - 1], speed)
        return np.where(push > 0, np.maximum(push + damping * slow, 0.0), 0.0)

    return _each(block, force, change)


def held_step(block: Block, force: np.ndarray, step: float, rng: np.random.Generator) -> np.ndarray:
    """The force of the last step but one, held until the next."""
    late = np.floor(block.t / step) * step - step
    return np.column_stack([np.interp(late, block.t, f) for f in force.T])


def flicker(block: Block, force: np.ndarray, share: float, rng: np.random.Generator) -> np.ndarray:
    """Bursts of one to five samples without contact."""
    out, row = force.copy(), 0
    while row < len(out):
        row += 1 + int(rng.geometric(share / 3))
        out[row : row + int(rng.integers(1, 6))] = 0.0
    return out


def fallen(block: Block, force: np.ndarray, share: float, rng: np.random.Generator) -> np.ndarray:
    """Some presses let the tip through on the way in."""
    out = force.copy()
    count = max(1, round(share * len(block.presses)))
    for number in rng.choice(len(block.presses), count, replace=False):
        press = block.presses[number]
        past = np.flatnonzero(press.into > rng.uniform(0.4, 0.9) * press.into.max())[0]
        out[press.rows][past:] = 0.0
    return out


FLAWS: tuple[Flaw, ...] = (
    Flaw("contact_stiffness", (300.0, 6000.0), soft_contact),
    Flaw("contact_nodes", (0.0025, 0.012), few_nodes),
    Flaw("mesh_stiffness", (1.05, 2.2), stiff_mesh),
    Flaw("numerical_damping", (0.8, 15.0), damping),
    Flaw("time_step", (0.006, 0.05), held_step),
    Flaw("lost_contact", (0.01, 0.3), flicker),
    Flaw("tunnelling", (0.04, 0.25), fallen),
    Flaw("contact_offset", (8e-5, 1.2e-3)),
    Flaw("numerical_drift", (4e-6, 6e-5)),
    Flaw("stated_modulus", (1.06, 3.0), given=lambda x: {"modulus_pa": MODULUS_PA * x}),
    Flaw("stated_tip_radius", (1.04, 1.5), given=lambda x: {"radius_m": RADIUS_M * x}),
    Flaw("stated_friction", (0.02, 0.25), given=lambda x: {"friction": x}),
    Flaw("stated_poisson_ratio", (0.30, 0.46), given=lambda x: {"poisson": x}),
)


def simulated(
    block: Block, planted: Sequence[tuple[Flaw, float]], seed: int, *, errors: float = 1.0
) -> tuple[np.ndarray, Given]:
    """((n, 3) N, what it was given) of a simulation with these flaws, in the order in which they act.

    errors: how far it leaves our law beside, as another good solver does: 2 % a place, 0.1 mm of first touch,
    1 mN, the same for one seed.
    """
    rng, own = np.random.default_rng([seed, 1]), np.random.default_rng([seed, 0])
    given, drift, stands_off = Given(), np.zeros(3), 0.0
    for flaw, strength in planted:
        if flaw.given is not None:
            given = dataclasses.replace(given, **flaw.given(strength))
        if flaw.name == "numerical_drift":
            direction = rng.normal(size=3) * [1, 0.3, 1]
            drift = strength * direction / np.linalg.norm(direction)
        if flaw.name == "contact_offset":
            stands_off = strength
    factor = np.exp(own.normal(0, 0.02 * errors, len(block.points)))
    onset = own.normal(0, 1e-4 * errors, len(block.points))

    def offset(press: Press) -> float:
        begun = float(block.t[press.rows][0])
        return float(onset[press.place] + stands_off + begun * (block.normals[press.place] @ drift))

    force = block.force(given, offset=offset, stiffer=lambda press: float(factor[press.place]))
    for flaw, strength in planted:
        if flaw.plant is not None:
            force = flaw.plant(block, force, strength, rng)
    return force + own.normal(0, 1e-3 * errors, force.shape), given
