"""How well a verdict says where the gap is: F1 of its bins (places, depth, rate, time) against the truth's.

A bin counts as one with a gap where the gap's rms there exceeds half the noise of a force 3-vector. Both
sides state newtons in the same bins (mechanics.presses.gap_bins); the truth's touches and a verdict's presses
are matched by their times.
"""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

LEAST = 0.5
"""Of the noise of a 3-vector: a smaller gap in a bin is none."""
OF_LARGEST = 0.5
"""... and of the same kind's largest bin, where it is asked where most of the gap is."""
APART_S = 0.5
"""A press so far from every touch of the truth is none of them."""
RESAMPLES = 400
KINDS = {"places": "", "depth": "depth_n", "rate": "phase_n", "time": "time_n"}
"""Bins by kind: the places that the verdict weighs, thirds of the depth, loading, holding and unloading,
thirds of the time."""


@dataclass(frozen=True)
class Located:
    """noise_n: N rms of the noise's 3-vector. bins: {kind: (true, stated)} N rms of the gap."""

    noise_n: float
    bins: dict[str, tuple[np.ndarray, np.ndarray]]


def located(item: dict[str, Any]) -> Located | None:
    """A case's bins; None where truth or verdict states none (older files, no answer)."""
    true, stated = item["truth"].get("where"), item["verdict"].get("where", {}).get("bins")
    if true is None or stated is None:
        return None
    found = {kind: (np.array(true[key]), np.array(stated[key])) for kind, key in KINDS.items() if key}
    clock = item["truth"].get("nuisances", {}).get("clock_s", 0.0)
    noise_n = float(np.sqrt(3) * item["truth"]["noise_rms_n"])
    return Located(noise_n, {"places": _places(true, stated, clock), **found})


def _places(true: dict[str, Any], stated: dict[str, Any], clock: float) -> tuple[np.ndarray, np.ndarray]:
    """(s,) N rms each, over the presses of each of the verdict's places."""
    start, end = np.reshape(true["press_s"], (-1, 2)).T + clock
    at = np.array(stated["press_s"])[:, None]
    off = np.maximum(np.maximum(start - at, at - end), 0.0)
    touch, site = off.argmin(axis=1), np.array(stated["site"])
    met = off.min(axis=1) < APART_S
    pairs = np.stack([np.array(true["press_n"])[touch], stated["press_n"]])
    rms = [np.sqrt((pairs[:, met & (site == s)] ** 2).mean(axis=1)) for s in np.unique(site[met])]
    both = np.reshape(rms, (-1, 2)).T
    return both[0], both[1]


def localisation(found: Sequence[Located]) -> dict[str, dict[str, Any]]:
    """{kind: {"there" and "most": counts and F1}} over cases.

    there: whether a bin has a gap; most: whether that is also half of the gap of the kind's largest bin. The
    baseline claims every bin. Cases in which the truth has no bin with a gap are not counted.
    """
    scores: dict[str, dict[str, Any]] = {}
    for kind in KINDS:
        counts: dict[str, list[list[int]]] = defaultdict(list)
        for case in found:
            true, stated = case.bins[kind]
            for word, share in (("there", 0.0), ("most", OF_LARGEST)):
                real, said = (_marked(rms, case.noise_n, share) for rms in (true, stated))
                if real.any():
                    counts[word].append([int(n.sum()) for n in (real & said, said, real)] + [len(real)])
        scores[kind] = {word: _scored(np.array(each)) for word, each in counts.items()}
    return scores


def _marked(rms: np.ndarray, noise_n: float, share: float) -> np.ndarray:
    return (rms > LEAST * noise_n) & (rms >= share * rms.max(initial=0.0))


def _scored(counts: np.ndarray) -> dict[str, Any]:
    """counts: (c, 4) of each case right, said, true and all bins."""
    drawn = np.random.default_rng(0).integers(0, len(counts), (RESAMPLES, len(counts)))
    right, said, true, bins = (int(n) for n in counts.sum(axis=0))
    f1 = 2 * right / (said + true)
    each = counts[drawn].sum(axis=1)
    low, high = np.quantile(2 * each[:, 0] / (each[:, 1] + each[:, 2]), [0.025, 0.975])
    return {
        "cases": len(counts), "right": right, "said": said, "true": true, "bins": bins, "f1": f1,
        "f1_ci95": [float(low), float(high)], "f1_of_every_bin": 2 * true / (bins + true),
    }  # fmt: skip
