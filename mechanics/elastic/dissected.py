"""A factorisation that knows which of its rows a load meets: a load on few nodes costs a third.

Nested dissection (George 1973) cuts a mesh into parts that meet in separators only. A part is factorised by
the library with its border kept last (Schur complement); separators, by the multifrontal method (Duff and
Reid 1983), as dense fronts up a tree. A load on one part then runs through it and its ancestors alone.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import scipy.sparse as sp
from numba import njit

from palpate.mechanics.elastic import pardiso

PART = 250
"""Nodes of a part, at most."""
_FRONT = 128
"""Nodes that a front eliminates, at most."""
_LANES = 24
"""Columns that a front takes at once: whole groups of three, and whole lanes of a processor."""


@dataclass(eq=False)
class _Part:
    """rows: (k,) unknowns that it eliminates. border: (b,) places in the array of separators' unknowns.
    above: the front that follows, -1 for none."""

    rows: np.ndarray
    border: np.ndarray
    above: int
    factor: pardiso.SchurFactor


@dataclass(eq=False)
class _Front:
    """own (k,), border (b,): places in the array of separators' unknowns. above: the front that follows, -1
    for none. lower: (k, k), below: (b, k), L of both, in Fortran's order."""

    own: np.ndarray
    border: np.ndarray
    above: int
    lower: np.ndarray
    below: np.ndarray


class DissectedFactor:
    """A = L L' of a symmetric positive definite matrix (n, n), CSR, both triangles, three unknowns a node.

    part: nodes of a part, at most. Raises ArithmeticError where the matrix is not positive definite.
    """

    def __init__(self, matrix: sp.csr_matrix, part: int = PART) -> None:
        graph = pardiso.graph_of_groups(matrix, 3)
        order = pardiso.dissection(graph)
        parts, fronts = _tree(graph[order][:, order].tocsr(), part)
        separators = np.sort(np.concatenate([np.zeros(0, dtype=int), *fronts]))
        self._kept = _spread(order[separators])
        place = np.full(len(order), -1)  # of a node among the separators' nodes
        place[order[separators]] = np.arange(len(separators))
        # what a front gets of those below it: their borders (nodes) and what they take; the last: of none
        waiting: list[list[tuple[np.ndarray, np.ndarray]]] = [[] for _ in range(len(fronts) + 1)]
        above = np.full(len(separators) + 1, -1)  # the front of a separator's node
        owns = [np.searchsorted(separators, front) for front in fronts]
        for k, own in enumerate(owns):
            above[own] = k

        beyond = 2.0 * float(abs(matrix).sum(axis=1).max())
        self._parts = []
        for inside in parts:
            nodes = np.sort(order[inside])
            border = _met(place, graph, nodes)
            rows = _spread(nodes)
            near = matrix[rows]
            factor = pardiso.SchurFactor(near[:, rows], near[:, self._kept[_spread(border)]], beyond)
            after = above[min(border, default=-1)]
            waiting[after].append((border, factor.taken()))
            self._parts.append(_Part(rows, _spread(border), after, factor))

        self._fronts = []
        for own, updates in zip(owns, waiting, strict=False):
            border = _met(place, graph, order[separators[own]])
            border = np.unique(np.concatenate([border, *(met for met, _ in updates)]))
            border = border[border > own[-1]]
            both, k = _spread(np.concatenate([own, border])), 3 * len(own)
            dense = _assembled(both, updates)
            updates.clear()
            dense[:, :k] += matrix[self._kept[both[:k]]][:, self._kept[both]].toarray().T
            if failed := pardiso.eliminate(dense, k):
                raise ArithmeticError(f"row {failed} of a separator is not positive")
            lower, below = np.array(np.tril(dense[:k, :k]), order="F"), np.array(dense[k:, :k], order="F")
            after = above[min(border, default=-1)]
            waiting[after].append((border, dense[k:, k:]))
            self._fronts.append(_Front(both[:k], both[k:], after, lower, below))

    def solve(self, right: np.ndarray) -> np.ndarray:
        """Solutions for right-hand sides (n,) or (n, r)."""
        flat = np.asarray(right, dtype=float).reshape(len(right), -1)
        kept = flat[self._kept]
        halves = []
        for part in self._parts:
            half, passed = part.factor.forward(flat[part.rows])
            kept[part.border] += passed
            halves.append(half)
        for front in self._fronts:
            own = np.asfortranarray(kept[front.own])
            pardiso.solve_lower(front.lower, own)
            kept[front.own] = own
            kept[front.border] -= pardiso.product(front.below, own)
        for front in reversed(self._fronts):
            border = np.asfortranarray(kept[front.border])
            own = np.asfortranarray(kept[front.own]) - pardiso.product(front.below, border, transposed=True)
            pardiso.solve_lower(front.lower, own, transposed=True)
            kept[front.own] = own
        result = np.empty_like(flat)
        result[self._kept] = kept
        for part, half in zip(self._parts, halves, strict=True):
            result[part.rows] = part.factor.backward(half, kept[part.border])
        return result.reshape(np.shape(right))

    def quadratic_forms(self, loads: sp.csr_matrix, each: int = 3) -> np.ndarray:
        """(r, c, c) b' A^-1 b of groups of c loads (n, r c). What a group gives does not hang, to the bit, on
        which others there are."""
        count = loads.shape[1] // each
        forms = np.zeros((count, each, each))
        kept = np.ascontiguousarray(loads[self._kept].toarray().T)  # a column's separators side by side
        met = np.zeros((len(self._fronts) + 1, count), dtype=bool)  # the last: what nothing follows
        for k, front in enumerate(self._fronts):
            met[k] = kept[:, front.own].reshape(count, -1).any(axis=1)
        for part in self._parts:
            mine = loads[part.rows]
            groups = np.unique(mine.indices // each)
            if len(groups):
                columns = _spread(groups, each)
                half, passed = part.factor.forward(mine[:, columns].toarray())
                forms[groups] += products(half, each)
                _add_at(kept, columns, part.border, passed.T, 1.0)
                met[part.above, groups] = True
        for k, front in enumerate(self._fronts):
            groups = np.flatnonzero(met[k])
            if len(groups):
                columns = _spread(groups, each)
                own = pardiso.in_lanes(_taken(kept, columns, front.own).T, lanes=_LANES)
                pardiso.solve_lower(front.lower, own)
                forms[groups] += products(own[:, : len(columns)], each)
                passed = pardiso.product(front.below, own)
                _add_at(kept, columns, front.border, passed.T, -1.0)
                met[front.above] |= met[k]
        return forms


def _met(place: np.ndarray, graph: sp.csr_matrix, nodes: np.ndarray) -> np.ndarray:
    """Places of the separators' nodes that nodes meet, ascending."""
    met = np.unique(place[graph[nodes].indices])
    return met[met >= 0]


def _assembled(both: np.ndarray, updates: list[tuple[np.ndarray, np.ndarray]]) -> np.ndarray:
    """(m, m) the sum of updates at places (m,), its lower triangle, columns contiguous."""
    # one of all its places, as from the front below in a chain, is written on in place
    whole = next((k for k, (met, _) in enumerate(updates) if 3 * len(met) == len(both)), None)
    dense = np.zeros((len(both),) * 2, order="F") if whole is None else updates[whole][1]
    for k, (met, update) in enumerate(updates):
        if k != whole:
            _add(dense, np.searchsorted(both, _spread(met)), update)
    return dense


@njit(cache=True)
def _add(whole, places, update):
    """Add the lower triangle of an update (b, b) at ascending places (b,)."""
    for j in range(len(places)):
        for i in range(j, len(places)):
            whole[places[i], places[j]] += update[i, j]


@njit(cache=True)
def _taken(whole, rows, columns):
    """(r, c) what stands at rows (r,) and columns (c,)."""
    values = np.empty((len(rows), len(columns)))
    for i in range(len(rows)):
        for j in range(len(columns)):
            values[i, j] = whole[rows[i], columns[j]]
    return values


@njit(cache=True)
def _add_at(whole, rows, columns, values, sign):
    """Add values, or take them off, at rows (r,) and columns (c,); values may hold more rows."""
    for i in range(len(rows)):
        for j in range(len(columns)):
            whole[rows[i], columns[j]] += sign * values[i, j]


def products(half: np.ndarray, each: int) -> np.ndarray:
    """(r, c, c) h' h of groups of c columns (n, r c)."""
    groups = np.ascontiguousarray(half).reshape(len(half), -1, each)
    if groups.shape[1] == 1:  # one alone is summed up in another order: its last bits would be others
        return np.einsum("fri,frj->rij", *2 * [np.repeat(groups, 2, axis=1)])[:1]
    return np.einsum("fri,frj->rij", groups, groups)


def _spread(nodes: np.ndarray, each: int = 3) -> np.ndarray:
    """(k c,) the unknowns of nodes, or the columns of groups (k,)."""
    return (each * np.asarray(nodes)[:, None] + np.arange(each)).ravel()


def _tree(ordered: sp.csr_matrix, part: int) -> tuple[list[np.ndarray], list[np.ndarray]]:
    """Parts and fronts of a graph in its order of elimination, as places in that order; each front comes
    before those that it borders on."""
    home = _homes(ordered.indptr, ordered.indices, part, _FRONT)
    places = np.argsort(home, kind="stable")
    groups = np.split(places, np.flatnonzero(np.diff(home[places])) + 1)
    return [g for g in groups if home[g[0]] < 0], [g for g in groups if home[g[0]] >= 0]


@njit(cache=True)
def _homes(starts, neighbours, part, front):
    """(n,) of each place: the last place of its front, or less than 0, the same within a part."""
    n = len(starts) - 1
    parent, ancestor = np.full(n, -1), np.full(n, -1)
    for k in range(n):  # elimination tree (Liu 1990)
        for p in range(starts[k], starts[k + 1]):
            i = neighbours[p]
            while i != -1 and i < k:
                above = ancestor[i]
                ancestor[i] = k
                if above == -1:
                    parent[i] = k
                i = above
    size = np.ones(n, dtype=np.int64)
    children = np.zeros(n, dtype=np.int64)  # with fronts of their own
    for k in range(n):
        if parent[k] >= 0:
            size[parent[k]] += size[k]
            children[parent[k]] += size[k] > part
    home, length = np.empty(n, dtype=np.int64), np.zeros(n, dtype=np.int64)
    for k in range(n - 1, -1, -1):
        p = parent[k]
        if size[k] <= part:  # small subtrees that hang on one node make one part
            home[k] = -(p + 2) if p < 0 or size[p] > part else home[p]
        elif p >= 0 and children[p] == 1 and length[home[p]] < front:
            home[k] = home[p]
        else:
            home[k] = k
        if home[k] >= 0:
            length[home[k]] += 1
    return home
