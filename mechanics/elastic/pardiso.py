"""MKL Pardiso for symmetric positive definite matrices: factor, solve, Schur complement. Absent where MKL
is.

Only this module speaks to the library; `available()` tells whether it is there (x86-64 wheels of
pypardiso).
"""

from __future__ import annotations

import contextlib
import ctypes
import os
import sys
from collections.abc import Mapping
from functools import cache
from pathlib import Path

import numpy as np
import scipy.sparse as sp

_DEFINITE, _INDEFINITE = 2, -2  # the library's names of real symmetric matrices
_LANES = 8  # columns that a processor takes at once: the library rounds what is left over otherwise


@cache
def _library() -> ctypes.CDLL | None:
    # its threads else spin for 200 ms after every call: 4 of the demo's 52 s of the processor
    os.environ.setdefault("KMP_BLOCKTIME", "0")
    # where MKL's wheels put it; pypardiso walks through the whole environment, seconds in a process
    for path in (
        *Path(sys.prefix, "lib").glob("libmkl_rt.*"),
        *Path(sys.prefix, "Library/bin").glob("mkl_rt.*"),
    ):
        with contextlib.suppress(OSError):
            return ctypes.CDLL(str(path))
    try:
        from pypardiso import PyPardisoSolver

        library = PyPardisoSolver().libmkl
    except (ImportError, OSError):
        return None
    library.pardiso.argtypes = None  # pypardiso's typed pointers; this handle to the library is our own
    return library


def available() -> bool:
    """True where MKL Pardiso can be loaded."""
    return _library() is not None


def _mkl() -> ctypes.CDLL:
    library = _library()
    if library is None:
        raise ImportError("MKL Pardiso cannot be loaded: install pypardiso, or take another backend")
    return library


def invert(matrix: np.ndarray) -> int:
    """Inverse of a symmetric positive definite matrix (C order) in its upper triangle; 0, or the failing row.

    Cholesky in MKL. The OpenBLAS of SciPy's wheels ends the process at 16,000 unknowns on two threads.
    """
    size, info = ctypes.c_int32(len(matrix)), ctypes.c_int32(0)
    lower = ctypes.c_char(b"L")  # in Fortran's order
    data = ctypes.c_void_p(matrix.ctypes.data)
    for step in (_mkl().dpotrf, _mkl().dpotri):
        step(ctypes.byref(lower), ctypes.byref(size), data, ctypes.byref(size), ctypes.byref(info))
        if info.value:
            return int(info.value)
    return 0


def in_lanes(columns: np.ndarray, rows: int | None = None, lanes: int = _LANES) -> np.ndarray:
    """Columns (k, r) with zeros below, up to so many rows, and beside, up to what a processor takes at
    once; in Fortran's order."""
    k, r = columns.shape
    whole = np.zeros((k if rows is None else rows, -(-r // lanes) * lanes), order="F")
    whole[:k, :r] = columns
    return whole


def eliminate(front: np.ndarray, width: int) -> int:
    """The first unknowns of a symmetric positive definite front (m, m), in its lower triangle, columns
    contiguous: L of them and, below, of the others, and what is left of these; 0, or the failing row."""
    m, rest = front.strides[1] // 8, len(front) - width
    at = front.ctypes.data
    below, last = at + 8 * width, at + 8 * (m + 1) * width
    info = ctypes.c_int32(0)
    lower = ctypes.c_char(b"L")
    _mkl().dpotrf(ctypes.byref(lower), _integer(width), ctypes.c_void_p(at), _integer(m), ctypes.byref(info))
    if rest and not info.value:
        _blas("dtrsm", b"RLTN", (rest, width), 1.0, (at, m), (below, m))
        _blas("dsyrk", b"LN", (rest, width), -1.0, (below, m), 1.0, (last, m))
    return int(info.value)


def solve_lower(lower: np.ndarray, right: np.ndarray, *, transposed: bool = False) -> None:
    """L^-1 b or L'^-1 b in place of b (k, r), from L (k, k); both in Fortran's order."""
    how = b"LLTN" if transposed else b"LLNN"
    k, r = right.shape
    if r and k:
        _blas("dtrsm", how, (k, r), 1.0, (lower.ctypes.data, k), (right.ctypes.data, k))


def product(a: np.ndarray, b: np.ndarray, *, transposed: bool = False) -> np.ndarray:
    """a b, or a' b, in Fortran's order, as a and b are."""
    (k, m), n = (a.shape if transposed else a.shape[::-1]), b.shape[1]
    result = np.zeros((m, n), order="F")
    if result.size and k:
        arrays = (a.ctypes.data, len(a)), (b.ctypes.data, k), 0.0, (result.ctypes.data, m)
        _blas("dgemm", b"TN" if transposed else b"NN", (m, n, k), 1.0, *arrays)
    return result


def _blas(name: str, how: bytes, sizes: tuple[int, ...], *rest: float | tuple[int, int]) -> None:
    """A routine by its letters, sizes, factors, and arrays with their leading dimensions."""
    values: list[object] = [ctypes.byref(ctypes.c_char(letter.to_bytes())) for letter in how]
    values += [_integer(size) for size in sizes]
    for each in rest:
        if isinstance(each, tuple):
            values += [ctypes.c_void_p(each[0]), _integer(each[1])]
        else:
            values.append(ctypes.byref(ctypes.c_double(each)))
    getattr(_mkl(), name)(*values)


def _integer(value: int) -> object:
    return ctypes.byref(ctypes.c_int32(value))


def _pointer(array: np.ndarray) -> ctypes.c_void_p:
    return ctypes.c_void_p(array.ctypes.data)


_NOTHING = np.zeros(1)


class _Handle:
    """One handle of the library for an upper triangle (n, n), CSR, sorted; frees MKL's memory when it dies.

    kind: of the matrix, as the library counts them. settings: {place: value} beside those that all share.
    """

    def __init__(
        self, upper: sp.csr_matrix, kind: int = _DEFINITE, settings: Mapping[int, int] | None = None
    ) -> None:
        self.kind, self.size = kind, upper.shape[0]
        self._values = np.ascontiguousarray(upper.data, dtype=np.float64)
        self._rows, self._columns = upper.indptr.astype(np.int32), upper.indices.astype(np.int32)
        self._handle, self._iparm = np.zeros(64, dtype=np.int64), np.zeros(64, dtype=np.int32)
        # values of our own, nested dissection, zero-based indices
        for place, value in {0: 1, 1: 2, 34: 1, **(settings or {})}.items():
            self._iparm[place] = value
        self._perm = np.zeros(self.size, dtype=np.int32)

    def phase(self, phase: int, right: np.ndarray) -> np.ndarray:
        """What the library's phase makes of (n,) or (n, r)."""
        right = np.asfortranarray(right, dtype=np.float64)
        solution = np.zeros_like(right)
        self._call(phase, right, solution, 1 if right.ndim == 1 else right.shape[1])
        return solution

    def _call(
        self, phase: int, right: np.ndarray = _NOTHING, solution: np.ndarray = _NOTHING, count: int = 1
    ) -> None:
        error = ctypes.c_int32(0)
        _mkl().pardiso(
            _pointer(self._handle), _integer(1), _integer(1), _integer(self.kind), _integer(phase),
            _integer(self.size), _pointer(self._values), _pointer(self._rows), _pointer(self._columns),
            _pointer(self._perm), _integer(count), _pointer(self._iparm), _integer(0), _pointer(right),
            _pointer(solution), ctypes.byref(error),
        )  # fmt: skip
        if error.value:
            raise ArithmeticError(f"Pardiso failed with error {error.value} in phase {phase}")

    def free(self) -> None:
        """Release the factor."""
        if self._handle.any():
            self._call(-1)
            self._handle[:] = 0

    def __del__(self) -> None:
        if not sys.is_finalizing() and getattr(self, "_handle", None) is not None:
            self.free()


class Pardiso(_Handle):
    """A factorisation of a symmetric positive definite matrix.

    matrix: (n, n) sparse, both triangles stored. group: unknowns that follow one another and meet the same
    others, such as a node's three: their graph is a ninth as large, and ordered in a third of the time. With
    `schur` (indices of k unknowns) the factorisation stops there and writes the dense (k, k) Schur complement
    on those unknowns, in ascending order of index, to `out`, C-contiguous and zero before. Raises
    ArithmeticError where the matrix is not positive definite.
    """

    def __init__(
        self,
        matrix: sp.csr_matrix,
        schur: np.ndarray | None = None,
        *,
        out: np.ndarray | None = None,
        definite: bool = True,
        group: int = 1,
    ) -> None:
        upper = sp.triu(matrix, format="csr")
        upper.sort_indices()
        # tell the number of nonzeros in the factor
        super().__init__(upper, _DEFINITE if definite else _INDEFINITE, {17: -1})
        if schur is not None:
            self._perm[schur] = 1
            self._iparm[35] = 1  # only the Schur complement, no factors to solve with
        elif group > 1:
            groups = dissection(graph_of_groups(matrix, group))
            self._perm = (group * groups[:, None] + np.arange(group, dtype=np.int32)).ravel()
            self._iparm[4] = 1  # in that order
        self._call(12, solution=_NOTHING if out is None else out)
        self.factor_nonzeros = int(self._iparm[17])

    def solve(self, right: np.ndarray) -> np.ndarray:
        """Solutions for right-hand sides (n,) or (n, r)."""
        return self.phase(33, right)

    def half_solve(self, right: np.ndarray) -> np.ndarray:
        """L^-1 P b for right-hand sides (n, r), A = P' L L' P: b' A^-1 c is the product of two halves.

        What a column gives does not hang, to the bit, on how many others there are.
        """
        return self.phase(331, in_lanes(right))[:, : right.shape[1]]


class _Order(_Handle):
    """The order of elimination that the library finds for a graph."""

    def found(self) -> np.ndarray:
        """(n,) int32, each unknown's place."""
        self._iparm[4] = 2  # write it
        self._call(11)
        return self._perm


def graph_of_groups(matrix: sp.csr_matrix, group: int) -> sp.csr_matrix:
    """Which groups of unknowns that follow one another meet: (k, k), sorted, from a matrix (group k, ...)."""
    first, size = matrix[::group], matrix.shape[0] // group
    graph = sp.csr_matrix((np.ones(first.nnz), first.indices // group, first.indptr), shape=(size, size))
    graph.sum_duplicates()
    return graph


def dissection(graph: sp.csr_matrix) -> np.ndarray:
    """(n,) the nodes of a graph (n, n) in the order of elimination by nested dissection."""
    upper = sp.triu(graph, format="csr")
    upper.sort_indices()
    return _Order(upper).found()


class SchurFactor:
    """A matrix (k, k), CSR, both triangles, and what it takes from those that it borders on.

    border: (k, b), CSR, B. beyond: greater than all eigenvalues of the whole; it stands on the border's
    diagonal, as the library wants what is left there positive definite too.
    """

    def __init__(self, matrix: sp.csr_matrix, border: sp.csr_matrix, beyond: float) -> None:
        k, b = border.shape
        self._own = k
        self._beyond = beyond
        upper = sp.bmat([[sp.triu(matrix), border], [None, beyond * sp.identity(b)]], format="csr")
        upper.sort_indices()
        self._phases = _Phases(upper, np.arange(k, k + b))
        self._left = self._phases.factorise(upper.data)

    def taken(self) -> np.ndarray:
        """-B' A^-1 B (b, b), columns contiguous; asked once, and not kept."""
        taken, self._left = self._left, np.zeros((0, 0))
        taken[np.diag_indices(len(taken))] -= self._beyond
        return taken.T

    def forward(self, right: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """(L^-1 b (k, r), -B' A^-1 b (b, r)) of right-hand sides (k, r)."""
        half = self._phases.phase(331, in_lanes(right, self._phases.size))[:, : right.shape[1]]
        return half[: self._own], half[self._own :]

    def backward(self, half: np.ndarray, border: np.ndarray) -> np.ndarray:
        """x (k, r) from L^-1 b (k, r) and the border's x (b, r)."""
        return self._phases.phase(333, np.concatenate([half, border]))[: self._own]


class PartialFactor:
    """Symmetric matrices of one pattern, factorised with k unknowns kept last: Schur complement and halves.

    upper: (n, n) upper triangle with its diagonal, CSR, sorted. kept: (k,) indices, ascending. The
    fill-reducing ordering is found once, here; `refresh` serves every later matrix of the pattern.
    """

    def __init__(self, upper: sp.csr_matrix, kept: np.ndarray) -> None:
        self.size, self._upper, self._kept = upper.shape[0], upper, np.asarray(kept)
        self._kind = _DEFINITE
        self._now: _Phases | None = None

    def refresh(self, values: np.ndarray) -> np.ndarray:
        """Factorise the matrix of these values (nnz,); the Schur complement (k, k) on the kept unknowns.

        Cholesky where the matrix is positive definite; LDL' from the first that is not.
        """
        if self._kind == _DEFINITE:
            with contextlib.suppress(ArithmeticError):
                return self._refresh(values)
            self._kind = _INDEFINITE
        return self._refresh(values)

    def _refresh(self, values: np.ndarray) -> np.ndarray:
        if self._now is None or self._now.kind != self._kind:
            self._now = _Phases(self._upper, self._kept, self._kind)
        return self._now.factorise(values)

    def forward(self, right: np.ndarray) -> np.ndarray:
        """(n,) what `backward` needs of b (n,); its kept entries are b_k - A_ki A_ii^-1 b_i."""
        assert self._now is not None, "refresh comes first"
        return self._now.phase(331, right)

    def backward(self, half: np.ndarray, kept: np.ndarray) -> np.ndarray:
        """x (n,) whose kept entries are `kept` (k,), from the result of `forward`."""
        assert self._now is not None, "refresh comes first"
        if self._now.kind == _INDEFINITE:
            half = self._now.phase(332, half)
        half = half.copy()
        half[self._kept] = kept
        return self._now.phase(333, half)


class _Phases(_Handle):
    """Matrices of one pattern, with some unknowns kept last: it keeps its ordering and the last factor."""

    def __init__(self, upper: sp.csr_matrix, kept: np.ndarray, kind: int = _DEFINITE) -> None:
        # perturbed pivots, Schur complement with factors
        super().__init__(upper, kind, {9: 13 if kind == _DEFINITE else 8, 35: 2 if len(kept) else 0})
        self._count = len(kept)
        self._perm[kept] = 1
        self._call(11)

    def factorise(self, values: np.ndarray) -> np.ndarray:
        self._values = np.ascontiguousarray(values, dtype=np.float64)
        schur = np.zeros((self._count, self._count))
        self._call(22, solution=schur)
        return 0.5 * (schur + schur.T)
