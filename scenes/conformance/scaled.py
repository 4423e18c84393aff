"""Bodies of the kit at another modulus and another tip: where strains are small, force goes as both."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from palpate.mechanics.model.material import ObjectMaterial
from palpate.mechanics.model.model import Model, Support, Tool
from palpate.mechanics.shape.tetmesh import FACES, TetMesh, lone_faces
from palpate.scenes.conformance.cases import BODIES, FRICTION, POISSON, TIP_M, YOUNG_PA
from palpate.scenes.conformance.truth import alone


@dataclass(frozen=True, eq=False)
class ScaledBody:
    """A body of the kit, as large for its tip as there. t (n,) s; centre (n, 3) m; force (n, 3) N on the
    tool, bound (n,) N, half width of its 95 % interval; friction: of the tip."""

    name: str
    model: Model
    t: np.ndarray
    centre: np.ndarray
    force: np.ndarray
    bound: np.ndarray
    friction: float = FRICTION


def scaled_body(name: str, young_modulus_pa: float = YOUNG_PA, tip_radius_m: float = TIP_M) -> ScaledBody:
    """One of the kit's bodies, with its own graded mesh and Poisson's ratio."""
    body = next(each for each in BODIES if each.name == name)
    solved, tip, longer = body.solved, alone(body), tip_radius_m / TIP_M
    stronger = young_modulus_pa / YOUNG_PA * longer**2
    tetrahedra = solved.tetrahedra.astype(np.int64)
    fixed = np.zeros(len(solved.points), dtype=bool)
    fixed[solved.fixed] = True
    touchable = np.zeros_like(fixed)
    touchable[tetrahedra[:, FACES].reshape(-1, 3)[lone_faces(tetrahedra)]] = True
    mesh = TetMesh(longer * solved.points, tetrahedra, fixed, touchable & ~fixed)
    model = Model(
        mesh,
        ObjectMaterial(young_modulus_pa, POISSON),
        Support(np.zeros(3), np.array([0.0, 0.0, 1.0])),
        Tool(tip_radius_m),
        longer * 0.01,
    )
    return ScaledBody(name, model, tip.t, longer * tip.centre, stronger * tip.force, stronger * tip.bound)
