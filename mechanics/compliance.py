"""The compliance of an object condensed on its touchable surface, for unit Young's modulus.

`condense`: exact, every touchable degree of freedom against every other, from the Schur complement of
the stiffness.
`surface_compliance`: the same under the Gaussian patch of mechanics.patch at the surface's corners, what
a servo interpolates; far smaller, and free of the singularity of point loads. `load_or_condense` keeps it
with a MODEL.
"""

from __future__ import annotations

import dataclasses
from dataclasses import dataclass

import numpy as np
import scipy.linalg as la
import scipy.sparse as sp

from mechanics import pardiso
from mechanics.effects.hold import base_hold
from mechanics.elasticity import stiffness
from mechanics.errors import MeshError, OptionError
from mechanics.model import Model
from mechanics.options import option
from mechanics.progress import Progress, silent
from mechanics.solver import Solver, free_dofs
from mechanics.store import content_key, load_or_build
from mechanics.surface_compliance import SurfaceCompliance, surface_compliance
from mechanics.tetmesh import TetMesh

_COLUMNS = 64  # right-hand sides solved at once
_CONDENSED = 0.75  # share of the unknowns taken from the Schur complement, whose square is held twice;
_SMALL = 1e8  # bytes: up to here all of them, which is faster
METHODS = ("schur", "columns")
FORMS = ("auto", "dense", "low-rank")


@dataclass(frozen=True)
class Compliance:
    """nodes: (t,) touchable nodes of the mesh. matrix: (3t, 3t) float64, symmetric positive definite, m
    Pa / N.

    matrix[3i + a, 3j + b]: displacement of node i along a for a unit force on node j along b, unit modulus.
    """

    nodes: np.ndarray
    matrix: np.ndarray


def condense(
    mesh: TetMesh,
    poisson_ratio: float,
    modulus_ratio: np.ndarray | None = None,
    *,
    method: str | None = None,
    backend: str | None = None,
    progress: Progress = silent,
) -> Compliance:
    """Condense the stiffness on the touchable nodes and invert it.

    method: 'schur' (static condensation in MKL Pardiso and one dense inverse; for a large result that for
    most of it and column solves for the rest, which bounds the memory), 'columns' (a solve a column, in
    batches, with either backend), None for the best that is there. Raises MeshError where the mesh is not
    held or has nothing to touch.
    """
    nodes = np.flatnonzero(mesh.touchable)
    free = free_dofs(mesh)
    wanted = (3 * nodes[:, None] + np.arange(3)).ravel()
    place = np.searchsorted(free, wanted)
    if not len(wanted) or place.max() >= len(free) or (free[place] != wanted).any():
        raise MeshError("the mesh has no touchable node that is free to move")
    if method not in (None, *METHODS):
        raise OptionError(f"method is '{method}'; allowed are {', '.join(METHODS)}")
    if method is None:
        method = "schur" if pardiso.available() and backend in (None, "pardiso") else "columns"
    k = len(wanted)
    result = np.empty((k, k))
    first = 0
    if method == "schur":
        first = k if result.nbytes <= _SMALL else int(_CONDENSED * k)
        matrix = stiffness(mesh, poisson_ratio, modulus_ratio)[free][:, free].tocsr()
        _condense_first(matrix, place[:first], result, progress)
        if first < k:
            solve = pardiso.Pardiso(matrix).solve
        del matrix
    else:
        solve = Solver(mesh, poisson_ratio, modulus_ratio, backend=backend).solve_free
    for start in range(first, k, _COLUMNS):
        part = slice(start, min(start + _COLUMNS, k))
        loads = np.zeros((len(free), part.stop - part.start), order="F")
        loads[place[part], np.arange(loads.shape[1])] = 1.0
        result[part] = solve(loads)[place].T
        progress("compliance columns", 0.5 * bool(first) + (1 - 0.5 * bool(first)) * part.stop / k)
    result[:first, first:] = result[first:, :first].T
    _symmetrise(result[first:, first:])
    progress("compliance", 1.0)
    return Compliance(nodes, result)


def _condense_first(matrix: sp.csr_matrix, place: np.ndarray, result: np.ndarray, progress: Progress) -> None:
    """Fill the first block of the result by the Schur complement on the unknowns `place` and its inverse.

    The complement is written to the front of the result's own memory, packed; the library holds another
    copy until it is freed.
    """
    progress("static condensation", 0.05)
    first = len(place)
    packed = result.reshape(-1)[: first * first].reshape(first, first)
    packed[:] = 0.0
    try:
        pardiso.Pardiso(matrix, schur=place, out=packed).free()
    except ArithmeticError as error:
        raise MeshError(f"the stiffness cannot be condensed ({error}): is every part held?") from error
    progress("dense inverse", 0.3)
    inverse(packed)
    for row in range(first - 1, 0, -1):  # from the last one, so that none is overwritten before it moves
        result[row, :first] = packed[row].copy()


def inverse(matrix: np.ndarray) -> np.ndarray:
    """Inverse of a symmetric positive definite matrix, in its own memory (the argument is overwritten)."""
    if pardiso.available():
        row = pardiso.invert(matrix)
    else:
        factor, row = la.lapack.dpotrf(matrix.T, lower=1, clean=0, overwrite_a=1)
        if not row:
            _, row = la.lapack.dpotri(factor, lower=1, overwrite_c=1)
    if row:
        raise MeshError(f"the condensed stiffness is not positive definite (at row {row}): mesh again")
    _mirror_upper(matrix)  # in C order the upper triangle holds the inverse
    return matrix


def _mirror_upper(matrix: np.ndarray, block: int = 512) -> None:
    n = len(matrix)
    for i in range(0, n, block):
        rows = slice(i, min(i + block, n))
        corner = matrix[rows, rows]
        corner[:] = np.triu(corner) + np.triu(corner, 1).T
        matrix[rows.stop :, rows] = matrix[rows, rows.stop :].T


def _symmetrise(matrix: np.ndarray, block: int = 512) -> None:
    n = len(matrix)
    for i in range(0, n, block):
        rows = slice(i, min(i + block, n))
        rest = slice(i, n)
        mean = 0.5 * (matrix[rows, rest] + matrix[rest, rows].T)
        matrix[rows, rest] = mean
        matrix[rest, rows] = mean.T


@dataclass(frozen=True)
class ComplianceOptions:
    """In which form `load_or_condense` keeps how a touch at one place moves another."""

    form: str = option("auto", "dense, low-rank, or auto: low-rank for a large surface", choices=FORMS)
    largest_dense_bytes: float = option(1.5e8, "dense table beyond which auto takes low-rank", unit="bytes")
    low_rank_error: float = option(0.005, "relative error of a low-rank table")

    def __post_init__(self) -> None:
        if self.form not in FORMS:
            raise OptionError(f"form is '{self.form}'; allowed are {', '.join(FORMS)}")
        if not 1e-6 < self.low_rank_error < 0.2:
            raise OptionError(f"low_rank_error is {self.low_rank_error}; it must lie between 1e-6 and 0.2")

    def error_of(self, mesh: TetMesh) -> float | None:
        """The low-rank error for a mesh, None where its table is to be dense."""
        corners = len(np.unique(mesh.touchable_surface[:, :3]))
        large = 36.0 * corners**2 > self.largest_dense_bytes
        dense = self.form == "dense" or (self.form == "auto" and not large)
        return None if dense else self.low_rank_error


def load_or_condense(
    model: Model, progress: Progress = silent, *, options: ComplianceOptions | None = None
) -> SurfaceCompliance:
    """The servo's compliance of a model: from the cache in its folder, or computed and stored there.

    The cache is keyed by everything that the numbers depend on and guarded by a checksum: a changed model,
    a damaged or a truncated file is rebuilt. Of the model's effects those of the base count
    (mechanics.support). That of a model that was never written stays in memory until the next one's. A
    folder that cannot be written keeps nothing. A large surface is compressed (ComplianceOptions).
    """
    material = model.material
    hold = base_hold(model.effects, model.support.normal, material.young_modulus_pa)
    held = () if hold is None else dataclasses.astuple(hold)
    balls = tuple(material.inclusions.values())
    error = (options or ComplianceOptions()).error_of(model.mesh)
    form = () if error is None else ("low-rank", error)
    key = content_key(
        "surface compliance 5",
        model.mesh.points,
        model.mesh.tetrahedra,
        model.mesh.fixed,
        model.mesh.touchable,
        material.poisson_ratio,
        model.ratio_without_balls,
        *held,
        *form,
        *([model.tool.tip_radius_m] if balls else []),
        *(value for ball in balls for value in dataclasses.astuple(ball)),
    )

    def build() -> dict[str, np.ndarray]:
        made = surface_compliance(
            model.mesh,
            material.poisson_ratio,
            model.ratio_without_balls,
            balls=balls,
            hold=hold,
            low_rank_error=error,
            tip_radius_m=model.tool.tip_radius_m,
            progress=progress,
        )
        return made.arrays()

    if model.path is not None:
        arrays = load_or_build(model.path / f"compliance-{key[:16]}.bin", key, build)
        return SurfaceCompliance.from_arrays(arrays)
    if key not in _unwritten:
        arrays = load_or_build(None, key, build)
        _unwritten.clear()
        _unwritten[key] = arrays
    return SurfaceCompliance.from_arrays(_unwritten[key])


_unwritten: dict[str, dict[str, np.ndarray]] = {}
"""The last one that has no folder to be kept in: who presses a model that was never written, and then replays
with it, waits once."""
