"""The plain arrays of the finite-element renderer: what it reads, and what it keeps between ticks."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from palpate.mechanics.contact.touch import STATE_SIZE
from palpate.mechanics.effects.laws_along_path import new_memory
from palpate.render.base import Grip, new_grip, new_state
from palpate.render.effects import EffectArrays
from palpate.render.surface.bvh import STACK
from palpate.render.surface.contact_surface import SurfaceArrays


class FemParameters(NamedTuple):
    """Read-only arrays of the kernel; v fine vertices, k fine triangles, n compliance nodes, unit modulus.

    far: (v, 3, 3) 1/m, NaN where it is not solved; far_before, series_before: what a state that goes on from
    the edition before leaves gradually (render.fem.kernel). curvature: (v,) 1/m (contact_curvature).
    bracing: (v,) 1/m (Field). softness: (v,) of the material under a tip, 1 where its modulus is the global
    one. parents: (k, 3) compliance nodes that interpolate over a triangle, -1 where fixed; parent_weights (k,
    3, 3). blocks: (n, n, 3, 3) 1/m, or of no size and factor: (n, 3, r) in their place, see
    SurfaceCompliance. table: dent law. young_modulus_pa, poisson_ratio, friction, series_compliance (m/N):
    (1,) each. edition: (1,) int64, that of the table.
    """

    surface: SurfaceArrays
    far: np.ndarray
    far_before: np.ndarray
    curvature: np.ndarray
    bracing: np.ndarray
    softness: np.ndarray
    parents: np.ndarray
    parent_weights: np.ndarray
    blocks: np.ndarray
    factor: np.ndarray
    table: np.ndarray
    young_modulus_pa: np.ndarray
    poisson_ratio: np.ndarray
    friction: np.ndarray
    series_compliance: np.ndarray
    series_before: np.ndarray
    edition: np.ndarray
    effects: EffectArrays


class FemState(NamedTuple):
    """render.base.State, and what the step keeps between ticks.

    grip: where each tip is held. frames: (m, 3, 3) rows n, u, v. elastic: (m, 3) N, quasi-static forces on
    the tools. memory: (m, STATE_SIZE) of the sticks. remembered: (m, laws, k) by the laws along each touch's
    path (`laws_along_path`). young: (m,) Pa under each tip. deepest: (m,) m of this touch. felt: (v,)
    greatest load of each fine vertex. Between contacts (render.fem.held_tips): nodes (m, 3), node_weights (m,
    3) interpolate at each tip; moved (m, 2) whether nodes or weights changed this tick; corners (m, m, 9, 9)
    1/m, blocks of the corners of pairs j < i; mixed (m, 3, r) the factor at each tip; links (m, 3, 3, m) m/N,
    [j, c, k, i] the displacement of tip i's place along k for a unit force on the object at tip j along c;
    carried (3, m) m, by how much the others move each place, with the sign turned, and carried_before that of
    its last solution; edition of the table, and before (1,), the share of the one before that is still felt;
    held (m,) int64, 1 where a tip's force did not settle in this tick; unsolved (v,) int8, 1 where the far
    field of a fine vertex was wanted that is not solved: it was taken for zero, and no force is right from
    then on; last (m, 3) m, where the tips were, and way (1,) m, how far they have gone since, together; quasi
    (m, 3) N, what is rendered of `elastic` (render.fem.kernel). The others are scratch.
    """

    forces: np.ndarray
    touching: np.ndarray
    points: np.ndarray
    normals: np.ndarray
    depths: np.ndarray
    stiffness: np.ndarray
    radii_m: np.ndarray
    dt_s: np.ndarray
    unsettled: np.ndarray
    grip: Grip
    frames: np.ndarray
    elastic: np.ndarray
    remembered: np.ndarray
    deepest: np.ndarray
    felt: np.ndarray
    memory: np.ndarray
    nodes: np.ndarray
    node_weights: np.ndarray
    moved: np.ndarray
    corners: np.ndarray
    mixed: np.ndarray
    links: np.ndarray
    carried: np.ndarray
    carried_before: np.ndarray
    edition: np.ndarray
    before: np.ndarray
    solution: np.ndarray
    flat: np.ndarray
    local_far: np.ndarray
    radius: np.ndarray
    curvature: np.ndarray
    bend: np.ndarray
    young: np.ndarray
    held: np.ndarray
    unsolved: np.ndarray
    last: np.ndarray
    way: np.ndarray
    quasi: np.ndarray
    base: np.ndarray
    base_triangle: np.ndarray
    base_force: np.ndarray
    fall: np.ndarray
    trial: np.ndarray
    vectors: np.ndarray
    stack: np.ndarray


def new_fem_state(parameters: FemParameters, radii: np.ndarray, dt_s: float) -> FemState:
    """A state of len(radii) tips in air."""
    m = len(radii)
    return FemState(
        *new_state(radii, dt_s),
        grip=new_grip(m),
        frames=np.zeros((m, 3, 3)),
        elastic=np.zeros((m, 3)),
        remembered=new_memory(parameters.effects.path, m),
        deepest=np.zeros(m),
        felt=np.zeros(len(parameters.surface.vertices)),
        memory=np.zeros((m, STATE_SIZE)),
        nodes=np.full((m, 3), -2, dtype=np.int64),
        node_weights=np.zeros((m, 3)),
        moved=np.zeros((m, 2), dtype=np.int64),
        corners=np.zeros((m, m, 9, 9), dtype=np.float32),
        mixed=np.zeros((m, 3, parameters.factor.shape[2])),
        links=np.zeros((m, 3, 3, m)),
        carried=np.zeros((3, m)),
        carried_before=np.zeros((3, m)),
        edition=parameters.edition.copy(),
        before=np.zeros(1),
        solution=np.zeros((m, 8)),
        flat=np.zeros(9),
        local_far=np.zeros((m, 3, 3)),
        radius=np.zeros(m),
        curvature=np.zeros(m),
        bend=np.zeros(m),
        young=np.zeros(m),
        held=np.zeros(m, dtype=np.int64),
        unsolved=np.zeros(len(parameters.surface.vertices), dtype=np.int8),
        last=np.zeros((m, 3)),
        way=np.zeros(1),
        quasi=np.zeros((m, 3)),
        base=np.zeros((4, 3)),
        base_triangle=np.zeros(1, dtype=np.int64),
        base_force=np.zeros(3),
        fall=np.zeros((2, 3)),
        trial=np.zeros(13),
        vectors=np.zeros((6, 3)),
        stack=np.zeros(STACK, dtype=np.int64),
    )
