"""What is pressed, where and how: six bodies, the tip's paths, and what was solved of them.

Object frame: metres, standing on z = 0, which is bonded. `python -m tools.conformance_truth` makes the files
of `solved/`: a graded mesh of each body, and the force by three laws that are one elastic solid where strains
are small.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from pathlib import Path

import numpy as np
from scipy.interpolate import PchipInterpolator

SOLVED = Path(__file__).parent / "solved"
YOUNG_PA, POISSON, FRICTION, TIP_M = 20e3, 0.45, 0.3, 0.010
RATE_HZ, AWAY_M = 500.0, 0.3e-3
SLOW_M_PER_S, FAST_M_PER_S, HOLD_S, REST_S = 0.01, 0.02, 0.1, 0.05
SHARES = np.array([0.1, 0.25, 0.5, 0.75, 1.0])
"""Solved depths of a press over its greatest; from the first on to none the force goes as Hertz's."""
STUCK = 0.05
"""Solved way sideways of a tip that sticks, over the press's depth, after the deepest."""
SLIDE = 0.6
"""Length of a slide over the press's depth: a sphere on a half-space slips as a whole from 0.43 on."""
MESH_SHARE, SHAPE_M, SLIP_SHARE = 0.01, 5e-6, 0.07
"""What the bound holds beside the laws: of the force, by the solver's own mesh (`palpate bench
press-solver`); of the depth, by facets of a body's file; of the force sideways, by Mindlin's law."""
BESIDE_M = 0.024
"""From a half-space's first tip to its second."""


@dataclass(frozen=True)
class Body:
    """One of the six. words: for the README. place: (3,) m near which it is pressed; along: (3,), how the tip
    slides; depth_m: of the press."""

    name: str
    words: str
    place: tuple[float, float, float]
    along: tuple[float, float, float]
    depth_m: float = 1e-3

    @cached_property
    def solved(self) -> Solved:
        """What is shipped of it."""
        with np.load(SOLVED / f"{self.name}.npz", allow_pickle=False) as stored:
            return Solved(**{key: stored[key] for key in stored.files})


@dataclass(frozen=True)
class Solved:
    """points (n, 3) m; tetrahedra (m, 4) of positive volume; fixed (f,), the nodes of the base. place, normal
    (3,): where the tip touches first; along (3,): how it slides. force (laws, depths + 1, 3) N on a tool that
    sticks, at SHARES of the depth and then STUCK along."""

    points: np.ndarray
    tetrahedra: np.ndarray
    fixed: np.ndarray
    place: np.ndarray
    normal: np.ndarray
    along: np.ndarray
    force: np.ndarray


BODIES = (
    Body("half-space", "a block of 800 x 800 x 400 mm, pressed in its top's middle", (0, 0, 0.4), (0, 1, 0)),
    Body("slab", "a layer 8 mm thick, 160 mm wide, bonded to its base", (0, 0, 0.008), (1, 0, 0)),
    Body("cylinder", "radius 40 mm, height 80 mm, pressed on its side", (0.04, 0, 0.045), (0, 0, 1)),
    Body("block", "105 x 105 x 47 mm, pressed 12 mm from an edge of its top", (0.0405, 0, 0.047), (0, 1, 0)),
    Body("dome", "a sphere of radius 60 mm cut to a height of 55 mm, pressed on its flank",
         (0.0387, 0, 0.0409), (0, 1, 0)),
    Body("kidney", "112 mm long and 46 mm high, one flank concave, pressed on its rounded rim",
         (0.03, 0.03, 0.044), (-1, 1, 0), 0.8e-3),
)  # fmt: skip


def strokes(depth_m: float, slides: bool = True, after_s: float = 0.0) -> np.ndarray:
    """(n, 2) m of a tip at RATE_HZ: below first touch, and how far it slid.

    Two presses, slow and fast, each with a hold; after the second it slides and holds, and the path ends in
    contact. after_s: of air before.
    """
    knots = [(0.0, -AWAY_M, 0.0)]

    def to(depth: float, slid: float, speed: float | None) -> None:
        t, was, at = knots[-1]
        took = HOLD_S if speed is None else (abs(depth - was) + abs(slid - at)) / speed
        knots.append((t + took, depth, slid))

    if after_s:
        knots.append((after_s, -AWAY_M, 0.0))
    to(depth_m, 0.0, SLOW_M_PER_S)
    to(depth_m, 0.0, None)
    to(-AWAY_M, 0.0, SLOW_M_PER_S)
    knots.append((knots[-1][0] + REST_S, -AWAY_M, 0.0))
    to(depth_m, 0.0, FAST_M_PER_S)
    to(depth_m, 0.0, None)
    if slides:
        to(depth_m, SLIDE * depth_m, SLOW_M_PER_S)
        to(depth_m, SLIDE * depth_m, None)
    t, depth, slid = np.array(knots).T
    at = np.arange(0.0, t[-1] + 1e-9, 1 / RATE_HZ)
    return np.column_stack([np.interp(at, t, depth), np.interp(at, t, slid)])


def pressed(body: Body, depth: np.ndarray) -> np.ndarray:
    """(laws, n, 3) N on a tip that is straight in by depths (n,) m, between the solved ones.

    A force over depth^1.5 hardly changes along a press.
    """
    own, solved = body.depth_m * SHARES, body.solved.force
    out = np.zeros((len(solved), len(depth), 3))
    touching = depth > 0
    for law, force in enumerate(solved):
        level = PchipInterpolator(own, force[: len(own)] / own[:, None] ** 1.5)
        out[law, touching] = level(np.maximum(depth[touching], own[0])) * depth[touching, None] ** 1.5
    return out
