"""Which effects look alike on these touches: angles between whitened sensitivities, and the touch that parts
them."""

from __future__ import annotations

import numpy as np

from diagnose.attribution import Candidate, Search
from diagnose.forward import Forward
from diagnose.result import NextTouch

ALIKE = 0.92
"""Cosine of the angle between two effects' residual patterns from which they are called confusable."""


def patterns(search: Search, base: Candidate, candidates: dict[str, Candidate]) -> dict[str, np.ndarray]:
    """(n, 3) N each: the force that adding the effect changes, at its best fit."""
    return {name: c.found.residual - base.found.residual for name, c in candidates.items()}


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


_RECIPES: dict[str, tuple[float, float, float, str]] = {
    # depth as a share of the greatest so far, speed m/s, hold s, why
    "rate": (0.8, 0.08, 1.5, "a fast press held still: memory decays in the hold, a delay and a play do not"),
    "slow": (0.8, 0.004, 0.5, "a slow press: a delay's loop vanishes with the speed, a play's stays"),
    "deep": (1.2, 0.01, 0.5, "a deeper press: laws of depth part where the dent is deepest"),
    "shallow": (
        0.35,
        0.01,
        0.5,
        "a shallow press: a skin or another tip is felt most before the object gives",
    ),
    "drag": (0.6, 0.02, 0.5, "a press dragged sideways: slip caps the tangential force, stick does not"),
    "repeat": (0.9, 0.02, 0.3, "the same place twice: softening stays, memory fades"),
    "place": (0.8, 0.02, 0.5, "a press where the candidates differ most in stiffness"),
}
_SUITS = {
    "viscoelasticity": "rate",
    "time_delay": "slow",
    "backlash": "slow",
    "mullins_softening": "repeat",
    "finite_strain": "deep",
    "strain_stiffening": "deep",
    "tip_radius": "shallow",
    "skin_layer": "shallow",
    "friction_slip": "drag",
    "adhesion": "slow",
}


def next_touch(
    forward: Forward, base: Candidate, first: str, second: str, candidates: dict[str, Candidate]
) -> NextTouch:
    """The press, among the places already found touchable, that would best separate two candidates.

    The place is where their fitted forces differ most a newton; speed, depth and hold follow the pair's kind.
    """
    t = forward.touches
    a = candidates[first].found.residual
    b = candidates[second].found.residual if second in candidates else base.found.residual
    difference = ((a - b) ** 2).sum(axis=1) * t.counted
    each = np.bincount(t.press, weights=difference, minlength=t.presses)
    each /= np.maximum(
        np.bincount(t.press, weights=(t.f**2).sum(axis=1) * t.counted, minlength=t.presses), 1e-9
    )
    press = int(np.argmax(each))
    kind = _SUITS.get(first) or _SUITS.get(second) or "place"
    if {first, second} == {"viscoelasticity", "time_delay"}:
        kind = "rate"
    share, speed, hold, why = _RECIPES[kind]
    direction = -t.normal[press]
    if kind == "drag":
        direction = direction + 0.5 * t.frame[press][1]
        direction = direction / np.linalg.norm(direction)
    return NextTouch(
        *map(float, t.point[press]),
        direction=tuple(float(d) for d in direction),
        depth_m=float(share * t.depth.max()),
        speed_m_per_s=speed,
        hold_s=hold,
        separates=(first, second),
        why=why,
    )
