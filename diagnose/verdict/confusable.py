"""Which effects look alike on these touches: angles between whitened sensitivities."""

from __future__ import annotations

import numpy as np

from diagnose.search.evidence import Candidate, Search

ALIKE = 0.92
"""Cosine of the angle between two effects' residual patterns from which they are called confusable."""


def patterns(search: Search, base: Candidate, candidates: dict[str, Candidate]) -> dict[str, np.ndarray]:
    """(n, 3) N each: the force that adding the effect changes, at its best fit."""
    return {name: c.residual - base.residual for name, c in candidates.items()}


def alike(search: Search, base: Candidate, candidates: dict[str, Candidate]) -> list[tuple[str, str, float]]:
    """Pairs whose best-fit patterns point the same way once modulus and nuisance are taken out, closest
    first."""
    names = list(candidates)
    if len(names) < 2:
        return []
    change = patterns(search, base, candidates)
    stack = np.stack([change[n] for n in names], axis=2)
    gram = search.whitener.gram(np.concatenate([base.found.jacobian[:, :, :1], stack], axis=2)).sum(axis=0)
    modulus = gram[0, 0]
    projected = gram[1:, 1:] - np.outer(gram[1:, 0], gram[0, 1:]) / max(modulus, 1e-12)
    size = np.sqrt(np.maximum(np.diag(projected), 1e-12))
    cosine = projected / np.outer(size, size)
    pairs = [
        (names[i], names[j], float(cosine[i, j]))
        for i in range(len(names))
        for j in range(i)
        if min(size[i], size[j]) > 3 and abs(cosine[i, j]) > ALIKE
    ]
    return sorted(pairs, key=lambda p: -abs(p[2]))
