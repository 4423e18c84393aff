"""The exact compliance of all touchable degrees of freedom: what benchmarks time and tests compare with.

A servo needs less (mechanics.compliance.surface_compliance); this is the Schur complement of the stiffness on
the touchable nodes, inverted.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import scipy.linalg as la
import scipy.sparse as sp

from palpate.mechanics.elastic import pardiso
from palpate.mechanics.elastic.elasticity import stiffness
from palpate.mechanics.elastic.solver import Solver, free_dofs
from palpate.mechanics.errors import MeshError, OptionError
from palpate.mechanics.progress import Progress, silent
from palpate.mechanics.shape.tetmesh import TetMesh

_COLUMNS = 64  # right-hand sides solved at once
_CONDENSED = 0.75  # share of the unknowns taken from the Schur complement, whose square is held twice;
_SMALL = 1e8  # bytes: up to here all of them, which is faster
METHODS = ("schur", "columns")


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
