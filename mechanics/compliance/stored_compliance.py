"""The compliance of an object condensed on its touchable surface, kept with a MODEL.

It is that under the Gaussian patch of mechanics.compliance.patch at the surface's corners, what a servo
interpolates (mechanics.compliance.surface_compliance).
"""

from __future__ import annotations

import dataclasses
from functools import partial
from pathlib import Path

import numpy as np

from palpate.mechanics.compliance.coarse_table import CoarseCompliance, first_places
from palpate.mechanics.compliance.fine_corners import (
    FineCorners,
    fine_corners,
    is_loose,
    narrowed,
)
from palpate.mechanics.compliance.on_demand import OnDemandCompliance
from palpate.mechanics.compliance.sites import surface_edge
from palpate.mechanics.compliance.surface_compliance import SurfaceCompliance, surface_compliance
from palpate.mechanics.disk.store import content_key, load_or_build, read_arrays
from palpate.mechanics.effects.hold import base_hold
from palpate.mechanics.elastic.held_base import BaseHold
from palpate.mechanics.elastic.solver import LARGE, Solver
from palpate.mechanics.errors import CacheError
from palpate.mechanics.law_errors import Bound
from palpate.mechanics.model.model import Model
from palpate.mechanics.progress import Progress, silent
from palpate.mechanics.shape.refine import refinement_key, typical_edge
from palpate.mechanics.shape.tetmesh import TetMesh

LARGEST_DENSE_BYTES = 1.5e8
"""Of a dense table: a larger surface gets one of low rank (surface_compliance)."""
LOW_RANK_ERROR = 0.005
"""Relative, of such a table."""


def low_rank_error(mesh: TetMesh) -> float | None:
    """Of the table of a mesh; None where that is dense."""
    corners = len(np.unique(mesh.touchable_surface[:, :3]))
    return LOW_RANK_ERROR if 36.0 * corners**2 > LARGEST_DENSE_BYTES else None


def compliance_key(model: Model, *, dense: bool = False) -> str:
    """64 hexadecimal digits over everything that the numbers of `load_or_condense` depend on; dense: of a
    table that is so whatever its size."""
    material, hold = model.material, _hold(model)
    balls = tuple(material.inclusions.values())
    error = None if dense else low_rank_error(model.mesh)
    return content_key(
        "surface compliance 10",
        model.mesh.points,
        model.mesh.tetrahedra,
        model.mesh.fixed,
        model.mesh.touchable,
        "" if model.mesh.shape is None else model.mesh.shape.key,
        *refinement_key(model.mesh),
        material.poisson_ratio,
        model.surface_ratio,
        *([model.stretch_m] if model.stretch_m else []),
        *(() if hold is None else dataclasses.astuple(hold)),
        *(() if error is None else ("low-rank", error)),
        *([model.tool.tip_radius_m, "felt by depth"] if balls else []),
        *(value for ball in balls for value in dataclasses.astuple(ball)),
    )


def compliance_file(key: str) -> str:
    """Name of the cached file of that key, in the model's folder."""
    return f"compliance-{key[:16]}.bin"


def _hold(model: Model) -> BaseHold | None:
    return base_hold(model.effects, model.support.normal, model.material.young_modulus_pa)


def load_or_condense(model: Model, progress: Progress = silent) -> SurfaceCompliance:
    """The servo's compliance of a model: from the cache in its folder, or computed and stored there.

    The cache is keyed by everything that the numbers depend on and guarded by a checksum: a changed model,
    a damaged or a truncated file is rebuilt. Of the model's effects those of the base count
    (mechanics.elastic.held_base). That of a model that was never written stays in memory until the next
    one's. A folder that cannot be written keeps nothing. A large surface is compressed.
    """
    material = model.material
    hold = _hold(model)
    key = compliance_key(model)

    def build() -> dict[str, np.ndarray]:
        made = surface_compliance(
            model.mesh,
            material.poisson_ratio,
            model.surface_ratio,
            balls=tuple(material.inclusions.values()),
            hold=hold,
            stretch_m=model.stretch_m,
            low_rank_error=low_rank_error(model.mesh),
            tip_radius_m=model.tool.tip_radius_m,
            solved=kept_places(model),
            progress=progress,
        )
        return made.arrays()

    if model.path is not None:
        arrays = load_or_build(model.path / compliance_file(key), key, build)
        return SurfaceCompliance.from_arrays(arrays)
    if key not in _unwritten:
        arrays = load_or_build(None, key, build)
        _unwritten.clear()
        _unwritten[key] = arrays
    return SurfaceCompliance.from_arrays(_unwritten[key])


def load_or_solve(model: Model, progress: Progress = silent) -> SurfaceCompliance | OnDemandCompliance:
    """The compliance of a model for one tip on few places: condensed where it is so already, else place by
    place as it is asked for; both give the same bits.

    A base that is loose in part is condensed: which of its places rest on the floor is found from place to
    place over the whole surface.
    """
    condensed = _condensed(model)
    if condensed is not None:
        return condensed
    if is_loose(_hold(model)):
        return load_or_condense(model, progress)
    return _on_demand(model)


def fills(model: Model) -> bool:
    """Whether there is something to solve, and places can be solved one by one."""
    return not is_loose(_hold(model)) and _condensed(model) is None


def load_coarse(model: Model) -> SurfaceCompliance | CoarseCompliance | None:
    """The compliance of a model from what is kept of it: condensed, or the places that are solved and what
    they tell of the others, else those of `own_places`; None where the first places are not all solved."""
    condensed = _condensed(model)
    if condensed is not None:
        return condensed
    for kept in (kept_places(model), own_places(model, kept=True)):
        if kept is not None and kept.is_solved[first_places(kept.own_points)].all():
            return CoarseCompliance(kept)
    return None


def kept_places(model: Model) -> OnDemandCompliance | None:
    """Of a model whose folder keeps places that were solved; None for others."""
    return None if is_loose(_hold(model)) or not _is_kept(*_places_of(model)) else _on_demand(model)


def own_places(model: Model, *, kept: bool = False) -> OnDemandCompliance | None:
    """The places of a model's mesh as it is, whose surface is not halved: they miss the others by
    `Bound.rough`, and are solved in a quarter of the time.

    None where they are solved as fast, or would have to be halved twice, or its modulus varies, which whole
    elements do not resolve; kept: and where its folder keeps none.
    """
    material, hold = model.material, _hold(model)
    halved = 1 < typical_edge(model.mesh) / surface_edge(model.mesh) <= 2 and len(model.mesh.points) >= LARGE
    uniform = not material.inclusions and bool((model.surface_ratio == 1).all())
    key, path = _kept_as("own places 1", model)
    if not halved or not uniform or is_loose(hold):
        return None
    if kept and not _is_kept(key, path):
        return None
    nu, stretch = material.poisson_ratio, model.stretch_m

    def solver() -> Solver:
        return Solver(model.mesh.quadratic(), nu, hold=hold, stretch_m=stretch)

    def corners() -> FineCorners:
        return narrowed(fine_corners(model.mesh, nu, hold=hold, stretch_m=stretch, solver=solver()))

    return OnDemandCompliance(model.mesh, nu, corners, solver, key, path, Bound.rough.value)


def _places_of(model: Model) -> tuple[str, Path | None]:
    return _kept_as("solved places 4", model)


def _kept_as(name: str, model: Model) -> tuple[str, Path | None]:
    key = content_key(name, compliance_key(model, dense=True))
    return key, None if model.path is None else model.path / f"places-{key[:16]}.bin"


def _is_kept(key: str, path: Path | None) -> bool:
    try:
        return path is not None and bool(read_arrays(path, key))
    except CacheError:
        return False


def _on_demand(model: Model) -> OnDemandCompliance:
    hold = _hold(model)
    mesh, nu, ratio = model.mesh, model.material.poisson_ratio, model.surface_ratio
    balls = tuple(model.material.inclusions.values())
    tip, stretch = model.tool.tip_radius_m, model.stretch_m
    key, path = _places_of(model)
    return OnDemandCompliance(
        mesh,
        nu,
        partial(fine_corners, mesh, nu, ratio, balls=balls, hold=hold, stretch_m=stretch, tip_radius_m=tip),
        lambda: Solver(mesh.quadratic(), nu, model.solid_ratio, hold=hold, stretch_m=stretch),
        key,
        path,
    )


def _condensed(model: Model) -> SurfaceCompliance | None:
    """What `load_or_condense` gives where it has nothing to do."""
    key = compliance_key(model)
    try:
        path = None if model.path is None else model.path / compliance_file(key)
        arrays = _unwritten.get(key) if path is None else read_arrays(path, key)
    except CacheError:
        return None
    return None if arrays is None else SurfaceCompliance.from_arrays(arrays)


_unwritten: dict[str, dict[str, np.ndarray]] = {}
"""The last one that has no folder to be kept in: who presses a model that was never written, and then replays
with it, waits once."""
