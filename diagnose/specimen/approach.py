"""What a few curves tell, none of which can be held out: each way in, a part of it left out in turn."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.integrate import trapezoid

from palpate.diagnosis.specimen.bench import Bench
from palpate.mechanics.contact.tip import Tip
from palpate.reconstruction.steps.s1_filter.noise import white_noise_std

_BLOCKS = 8
_SHIFTS = np.linspace(-0.1, 0.1, 401)
"""Of first touch, in shares of the depth: finer than what tells one law from another."""
_RESTS, _ENDS = 0.97, 5
"""Share of the depth down to which a tip rests, and rows at either end of it that tell the force."""
SURE_PULL = 5.0
"""Standard deviations of the noise that a pull must exceed: no noise reaches so far in some thousand rows."""


@dataclass(frozen=True)
class Approach:
    """What a few curves tell, none of which can be held out: each way in, block by block of it left out in
    turn.

    error: dent law (and 'hunt-crossley', 'regression', 'constant') -> rms error over rms force, median of
    the curves. law: the best of the dents. modulus_pa: (c,) by it. hysteresis: share of the work that does
    not come back (NaN: the curves end in a hold); pull_n: (c,) N, greatest pull on the way out, 0 where noise
    alone reaches so far. fades: share of the force that is gone at the end of a rest at depth, median of the
    curves that rest (0 where noise alone does so). first: law's shift of the first curve's first touch, m in
    a hand's size.
    """

    error: dict[str, float]
    law: str
    modulus_pa: np.ndarray
    hysteresis: float
    pull_n: np.ndarray
    fades: float
    first: float = 0.0


def approach_of(bench: Bench) -> Approach:
    """The ways in of a bench's curves on a half-space."""
    presses, nu, tip = bench.model.presses, bench.model.material.poisson_ratio, bench.tip
    errors: dict[str, list[float]] = {}
    moduli: dict[str, list[float]] = {}
    shifts: dict[str, list[float]] = {}
    work, pull, fades = [], [], []
    for part in presses.parts:
        u, push = presses.depth[part], presses.push[part]
        top = int(np.argmax(push))
        ways = u[: top + 1], push[: top + 1]
        for name in tip.laws:
            error, modulus, shift = _left_out(*ways, tip, name, nu)
            errors.setdefault(name, []).append(error)
            shifts.setdefault(name, []).append(shift)
            moduli.setdefault(name, []).append(modulus)
        for name, order in (("hunt-crossley", 0), ("regression", 5)):
            errors.setdefault(name, []).append(_plainly_left_out(*ways, order))
        errors.setdefault("constant", []).append(_constant(ways[1]))
        back = slice(top, top + int(np.argmax(np.append(u[top:] <= 0, True))))
        given = max(trapezoid(push[: top + 1], u[: top + 1]), 1e-300)
        # a curve that ends in its hold gives nothing back to be weighed
        gone = 1 + trapezoid(push[back], u[back]) / given
        work.append(gone if u[part.stop - part.start - 1] < 0.5 * u.max() else np.nan)
        rest = top + int(np.argmax(np.append(u[top:] < _RESTS * u[top], True)))
        noise = white_noise_std(push[:, None])
        if rest - top > 2 * _ENDS:
            begun, ended = (float(np.median(x)) for x in (push[top:rest][:_ENDS], push[top:rest][-_ENDS:]))
            fades.append((begun - ended) / begun if begun - ended > SURE_PULL * noise else 0.0)
        pulls = -float(push[top:].min())
        sure = pulls > SURE_PULL * noise
        pull.append((pulls if sure else 0.0) / bench.similarity.force)
    medians = {name: float(np.median(values)) for name, values in errors.items()}
    law = min(tip.laws, key=lambda name: medians[name])
    own = np.array(moduli[law]) / bench.similarity.modulus
    faded = float(np.median(fades or [0.0]))
    return Approach(medians, law, own, float(np.median(work)), np.array(pull), faded, shifts[law][0])


def _blocks(count: int) -> np.ndarray:
    return np.minimum(np.arange(count) * _BLOCKS // max(count, 1), _BLOCKS - 1)


def _left_out(u: np.ndarray, push: np.ndarray, tip: Tip, law: str, nu: float) -> tuple[float, float, float]:
    """(held-out rms over rms, modulus, shift of first touch) of one way in; the last two are free."""
    span = float(u.max())
    shapes = np.array([tip.force(law, u - s * span, 1.0, nu) for s in _SHIFTS])

    def fitted(seen: np.ndarray) -> tuple[int, float]:
        power = np.maximum((shapes[:, seen] ** 2).sum(axis=1), 1e-300)
        along = shapes[:, seen] @ push[seen]
        k = int(np.argmax(np.maximum(along, 0.0) ** 2 / power))
        return k, float(along[k] / power[k])

    block, predicted = _blocks(len(u)), np.zeros(len(u))
    for b in range(1, _BLOCKS - 1):
        k, e = fitted(block != b)
        predicted[block == b] = e * shapes[k, block == b]
    k, e = fitted(np.ones(len(u), dtype=bool))
    return _relative(predicted, push, block), e, float(_SHIFTS[k]) * span


def _plainly_left_out(u: np.ndarray, push: np.ndarray, order: int) -> float:
    """The same of k u^r (order 0) or of a polynomial of the depth."""
    block, predicted = _blocks(len(u)), np.zeros(len(u))
    x = np.maximum(u, 0.0) / max(float(u.max()), 1e-300)
    exponents = np.linspace(0.5, 3.0, 26)
    for b in range(1, _BLOCKS - 1):
        seen = block != b
        if order:
            basis = x[:, None] ** np.arange(1, order + 1)
            predicted[~seen] = basis[~seen] @ np.linalg.lstsq(basis[seen], push[seen], rcond=None)[0]
            continue
        k = np.array(
            [(x[seen] ** r) @ push[seen] / max((x[seen] ** (2 * r)).sum(), 1e-300) for r in exponents]
        )
        cost = [float(((k[i] * x[seen] ** r - push[seen]) ** 2).sum()) for i, r in enumerate(exponents)]
        best = int(np.argmin(cost))
        predicted[~seen] = k[best] * x[~seen] ** exponents[best]
    return _relative(predicted, push, block)


def _constant(push: np.ndarray) -> float:
    """The same of the mean force: what says nothing of the depth."""
    block = _blocks(len(push))
    inner = push[(block > 0) & (block < _BLOCKS - 1)]
    return _relative(np.full(len(push), inner.mean() if len(inner) else 0.0), push, block)


def _relative(predicted: np.ndarray, push: np.ndarray, block: np.ndarray) -> float:
    """Over the blocks between the ends, where nothing has to be carried on."""
    inner = (block > 0) & (block < _BLOCKS - 1)
    missed, whole = (predicted - push)[inner], push[inner]
    return float(np.sqrt((missed**2).mean() / max((whole**2).mean(), 1e-300)))
