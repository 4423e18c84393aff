"""Which causes are ruled out after each press, so that one may look whenever one likes.

Each cause is a hypothesis with a fixed prior over its forms and sizes, 'none' among them, and the evidence
for it is its marginal likelihood M of all that was felt. Under hypothesis r the ratio of the mean of all M to
M_r is a martingale that starts at 1 (the prior-posterior ratio; Robbins 1970, Waudby-Smith & Ramdas 2020), so
by Ville's inequality it ever exceeds 1 / alpha with a probability of at most alpha. What has not fallen below
alpha times the mean is the set of causes: whatever is true stays in it through the whole exploration with
probability 1 - alpha, however often one looks, and whenever one stops.

'None' is not nothing: it is every cause at every size that is too small to matter, so that an error of our
own law, which many presses show ever more plainly, rules it out only once it is a gap that one would feel.

The likelihood is that of diagnose.explore.weighing. Its logarithm is divided by what slow noise adds and by
the lack of fit that the best cause leaves (never less than 1): a power of a likelihood below 1 keeps the
inequality (Jensen), and pays for a law that is not exact.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.special import log_ndtr

from palpate.diagnosis.explore.estimate import ExplorationEstimate
from palpate.diagnosis.explore.weighing import Act, Weighing, weigh
from palpate.diagnosis.forward.prediction import Forward
from palpate.diagnosis.options import AttributionOptions
from palpate.mechanics.effects.registry import effect
from palpate.mechanics.law_errors import Smallest

NONE = "none"
FALSE_ALARMS = 0.02
"""Probability of ruling 'none' out at any time where it is true."""
SIZES = np.geomspace(1.0, 100.0, 13)
"""Sizes of a cause that are weighed, times `least_n`: each span between two of them is as likely, and within
it each size."""
SMALL = np.linspace(0.0, 1.0, 5)
"""Sizes that are none, likewise: what is too small to matter, a cause or an error of ours alike."""
LEAST_SHARE = Smallest.exploring.value
"""Of the force: a smaller change does not matter, however plainly many presses show it."""
TWO_SIGNED = frozenset({"inclusion"})
"""A form of which may as well be the other way round."""


@dataclass(frozen=True)
class Causes:
    """What is known of the causes after the presses so far.

    log_evidence: of each cause and 'none', log M over the ideal model's. least_n: N rms over contact samples,
    the smallest size of a cause that is weighed. misfit: lack of fit (whitened mean square) that the best one
    leaves.
    """

    log_evidence: dict[str, float]
    least_n: float
    misfit: float

    @property
    def ratio(self) -> dict[str, float]:
        """Of each hypothesis, M over the mean of all M; as likely as at first where it is 1."""
        names = list(self.log_evidence)
        log = np.array([self.log_evidence[n] for n in names])
        mean = np.logaddexp.reduce(log + np.log(prior_of(names)))
        return dict(zip(names, np.exp(np.clip(log - mean, -700, 50)).tolist(), strict=True))

    @property
    def probability(self) -> dict[str, float]:
        """Posterior probabilities, with 'none' as likely before as all causes together."""
        names = list(self.ratio)
        return dict(zip(names, (prior_of(names) * list(self.ratio.values())).tolist(), strict=True))

    def not_ruled_out(self, at: float) -> list[str]:
        """The hypotheses that are left, the likeliest first; each true one stays in with probability `at`,
        'none' with 1 - FALSE_ALARMS."""
        ratio = self.ratio
        return sorted((n for n, r in ratio.items() if r > _least_ratio(n, at)), key=lambda n: -ratio[n])

    def missing(self, name: str, at: float) -> float:
        """Log by which a hypothesis must still fall to be ruled out; 0 where it is."""
        return max(0.0, float(np.log(max(self.ratio[name], 1e-300) / _least_ratio(name, at))))

    def table(self, at: float) -> dict[str, object]:
        """As JSON has it."""
        return {
            "standing": self.not_ruled_out(at),
            "probability": self.probability,
            "ratio": self.ratio,
            "least_n": self.least_n,
            "misfit": self.misfit,
        }


def _least_ratio(name: str, at: float) -> float:
    """The ratio from which a hypothesis is ruled out."""
    return min(1 - at, FALSE_ALARMS) if name == NONE else 1 - at


def prior_of(names: Sequence[str]) -> np.ndarray:
    """(k,) half for 'none', the rest evenly for the causes."""
    each = 0.5 / max(len(names) - 1, 1)
    return np.array([0.5 if n == NONE else each for n in names])


def causes_of(estimate: ExplorationEstimate) -> tuple[Causes, Weighing] | None:
    """None with fewer presses than LEAST_PRESSES, or without a surface."""
    weighing = weigh(estimate)
    if weighing is None:
        return None
    return judge(weighing, least_that_matters(weighing.forward)), weighing


def least_that_matters(forward: Forward) -> float:
    """N rms over contact samples: the smallest gap that a diagnosis names, or LEAST_SHARE of the force."""
    t = forward.touches
    return max(AttributionOptions().smallest * t.vector_noise_n, LEAST_SHARE * t.force_rms_n)


def judge(weighing: Weighing, least_n: float) -> Causes:
    """The evidence of every cause, and of none."""
    w = weighing
    names = [NONE, *dict.fromkeys(w.names)]
    target, curve, fitted = projected(w)
    explained = np.where(curve > 0, target**2 / np.maximum(curve, 1e-300), 0.0)
    misfit = (fitted - explained.max(initial=0.0)) / w.dof
    target, curve = with_support(w, target, curve)
    over = w.inflation(misfit)
    log, small = {NONE: 0.0}, []
    for name in names[1:]:
        rows = [i for i, n in enumerate(w.names) if n == name]
        log[name] = _log_mean(_evidence(w, rows, target, curve, least_n * SIZES, over))
        small.append(_log_mean(_evidence(w, rows, target, curve, least_n * SMALL, over)))
    log[NONE] = _log_mean(np.array(small or [0.0]))
    return Causes(log, least_n, float(misfit))


def projected(w: Weighing) -> tuple[np.ndarray, np.ndarray, float]:
    """(f,) and (f,): inner product of each form with the residual, and with itself, both beside the free
    modulus and our own common errors; and the residual's with itself."""
    k = 2 + w.own
    prior = np.diag([1e-9, *np.ones(w.own)])
    nuisance = w.gram[1:k, 1:k] + prior
    with_residual = np.linalg.solve(nuisance, w.gram[1:k, 0])
    with_forms = np.linalg.solve(nuisance, w.gram[1:k, k:])
    target = w.gram[k:, 0] - w.gram[k:, 1:k] @ with_residual
    curve = np.diag(w.gram)[k:] - np.einsum("fk,kf->f", w.gram[k:, 1:k], with_forms)
    return target, np.maximum(curve, 0.0), float(w.gram[0, 0] - w.gram[0, 1:k] @ with_residual)


def with_support(w: Weighing, target: np.ndarray, curve: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """The same products with what the rigid support shows: a yielding tool shows there by itself."""
    if w.on_support is None:
        return target, curve
    yields, error = w.on_support
    return target + w.springs * yields / error**2, curve + (w.springs / error) ** 2


def likeliest(w: Weighing, name: str, least_n: float) -> tuple[Act, float] | None:
    """(the form of a cause that fits best, its size in units of the form); None for 'none'."""
    if name == NONE:
        return None
    target, curve = with_support(w, *projected(w)[:2])
    rows = [i for i, n in enumerate(w.names) if n == name]
    size = target[rows] / np.maximum(curve[rows], 1e-300)
    if name not in TWO_SIGNED:
        size = np.maximum(size, 0.0)
    gain = size * target[rows] - 0.5 * size**2 * curve[rows]
    best = int(np.argmax(gain))
    least = least_n * SIZES[0] / max(float(w.sizes[rows[best]]), 1e-9)
    if abs(size[best]) < least:
        return w.acts[rows[best]], float(least)
    return w.acts[rows[best]], float(size[best])


def _evidence(
    w: Weighing, rows: list[int], target: np.ndarray, curve: np.ndarray, sizes_n: np.ndarray, over: float
) -> np.ndarray:
    """Log likelihood ratios to the ideal model of the forms `rows`, each the mean over a span between
    sizes (k,) N, both signs where it has both."""
    edges = sizes_n / np.maximum(w.sizes[rows], 1e-9)[:, None]
    curved = curve[rows, None] / over
    signs = (1.0, -1.0) if w.names[rows[0]] in TWO_SIGNED else (1.0,)
    return np.concatenate([_mean_over(edges, s * target[rows, None] / over, curved).ravel() for s in signs])


def _mean_over(edges: np.ndarray, target: np.ndarray, curve: np.ndarray) -> np.ndarray:
    """(f, k - 1) logarithm of the mean of exp(target x - curve x^2 / 2) over x between two of edges (f, k);
    target, curve (f, 1).

    By the normal distribution: where readings are many a size between two points of a grid is missed by
    thousands of nats.
    """
    low, high = edges[:, :-1], edges[:, 1:]
    middle, half = 0.5 * (low + high), 0.5 * (high - low)
    at_middle = target * middle - 0.5 * curve * middle**2
    root = np.sqrt(np.maximum(curve, 1e-300))
    # standard deviations from the most likely x, on the side where the tail is that keeps its digits
    near, far = root * low - target / root, root * high - target / root
    upper = near > 0
    near, far = np.where(upper, -far, near), np.where(upper, -near, far)
    share = log_ndtr(far) + np.log1p(-np.exp(np.minimum(log_ndtr(near) - log_ndtr(far), -1e-16)))
    wide = 0.5 * (target / root) ** 2 + share + 0.5 * np.log(2 * np.pi) - np.log(root * 2 * half)
    straight = (np.abs(target - curve * middle) + root) * half < 1e-4
    return np.where(straight, at_middle, wide)


def _log_mean(log: np.ndarray) -> float:
    return float(np.logaddexp.reduce(log) - np.log(len(log)))


def words(name: str) -> str:
    """What a cause is called among words."""
    if name == NONE:
        return "nothing but the ideal model"
    return effect(name).plain_words or name.replace("_", " ")
