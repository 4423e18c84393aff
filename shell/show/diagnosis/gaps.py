"""What a diagnosis's pictures and page are made of: gaps by press, by place, with one effect or another."""

from __future__ import annotations

from functools import cache
from typing import Any

import numpy as np

from palpate.diagnosis.verdict.result import Diagnosis
from palpate.mechanics.effects.base import Role
from palpate.mechanics.effects.finite_strain import LAW as FINITE_STRAIN_LAW
from palpate.mechanics.effects.registry import effects
from palpate.mechanics.model.model import Model
from palpate.mechanics.presses.table import Presses
from palpate.mechanics.recording.recording import Recording
from palpate.show.scenery import spread_over
from palpate.words import spaced

MOST_EFFECTS = 8
MOST_SHOWN = 3
"""Effects that a picture shows; the table has the rest."""


def diagnosed(result: Diagnosis) -> tuple[Recording, Model]:
    """(recording, model), of a diagnosis `diagnose` made."""
    assert result.recording is not None and result.model is not None, "only what `diagnose` returned has them"
    return result.recording, result.model


def gap_of(result: Diagnosis) -> tuple[Presses, np.ndarray, np.ndarray]:
    """(touches, gap (n, 3) N without any effect, gap with those found), of a diagnosis `diagnose` made."""
    assert result.forward is not None, "only what `diagnose` returned holds its touches"
    assert result.residual_before is not None and result.residual_after is not None
    return result.forward.touches, result.residual_before, result.residual_after


def sites_of(result: Diagnosis) -> np.ndarray:
    """(k, 3) m, the places that were touched."""
    return gap_of(result)[0].site_point


def gap_at(result: Diagnosis, points: np.ndarray) -> np.ndarray:
    """(n,) N, the rms gap at points (n, 3) m: that of the sites, spread over what is near."""
    return spread_over(points, sites_of(result), result.where.site_rmse)[0]


def press_gaps(result: Diagnosis) -> np.ndarray:
    """(p,) N, the rms gap of each press."""
    t, before, _ = gap_of(result)
    square = np.bincount(t.press, weights=(before**2).sum(axis=1) * t.counted, minlength=len(t))
    return np.sqrt(square / np.maximum(np.bincount(t.press, weights=t.counted, minlength=len(t)), 1))


def ranked(result: Diagnosis) -> np.ndarray:
    """Presses, the one with the largest gap first."""
    return np.argsort(-press_gaps(result))


def worst_press(result: Diagnosis) -> int:
    """The one with the largest gap at the place with the largest: the place that words and ring name."""
    there = np.flatnonzero(gap_of(result)[0].site == np.argmax(result.where.site_rmse))
    return int(there[np.argmax(press_gaps(result)[there])])


def in_model(result: Diagnosis) -> set[str]:
    """The effects that the model which was diagnosed renders already, by its law or its [effects]."""
    if result.model is None:
        return set()
    law = {known()} if result.model.material.dent_law == FINITE_STRAIN_LAW else set()
    return law | set(result.model.effects)


def depth_contrast(result: Diagnosis) -> float:
    """How many times larger (rms) the gap is in the deepest third of the contact samples than in the
    shallowest; nan where nothing was counted."""
    t, before, _ = gap_of(result)
    depth, square = t.travel[t.counted, 0], (before[t.counted] ** 2).sum(axis=1)
    if not len(depth):
        return float("nan")
    low, high = np.quantile(depth, [1 / 3, 2 / 3])
    shallow = np.maximum(square[depth <= low].mean() - 3 * t.noise_n**2, 1e-3 * square.mean())
    return float(np.sqrt(max(square[depth >= high].mean() - 3 * t.noise_n**2, 0.0) / shallow))


def sideways(result: Diagnosis) -> bool:
    """Whether the gap is in the force along the surface more than in that into it."""
    return result.where.leading.axis == "direction"


@cache
def known() -> str:
    """The effect that every solid has, which others are tried beside: finite strain."""
    return next(e.name for e in effects() if e.role is Role.KNOWN)


def residual_with(result: Diagnosis, name: str) -> np.ndarray | None:
    """(n, 3) N, measured less simulated with one effect (beside finite strain where that is part of it);
    None where it was not simulated."""
    found = result.attribution
    if found is None:
        return None
    if name == known():
        return found.deep.residual
    return found.scores[name].candidate.residual if name in found.scores else None


def with_strain(result: Diagnosis, name: str) -> bool:
    """Whether an effect was tried beside finite strain."""
    found = result.attribution
    return bool(
        found
        and name != known()
        and name in found.scores
        and known() in found.scores[name].candidate.found.names
    )


def beside(result: Diagnosis, name: str) -> str:
    """An effect's name, and finite strain where it was tried beside it."""
    return spaced(name) + (f" and {spaced(known())}" if with_strain(result, name) else "")


def shown_entries(result: Diagnosis) -> list[Any]:
    """Those that pictures show: what is named and its rivals, else the best that were tried."""
    judged = [e for e in result.entries if e.gap_closed is not None]
    named = {*result.effects, *result.candidates}
    return ([e for e in judged if e.name in named] or judged)[:MOST_SHOWN]
