"""What our own model may get wrong in a comparison, with a variance of its own, estimated for each recording.

A residual is sensor noise, what parameters change, and errors of our own law: of each press (first touch,
stiffness against its repeats, stick, rate), of each place (stiffness, normal, bend of the depth law,
memory), and a random field over the surface that acts on stiffness and first touch, since a wrong surface
is wrong over a region. Each has the size that it usually has (`USUAL`), known to a factor; how large it is
here follows from the recording by restricted marginal likelihood (Patterson & Thompson 1971). Woodbury
keeps all matrices small.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.optimize import minimize

from diagnose.forward import Forward
from mechanics.effects.settings import Settings
from mechanics.samples import delayed
from palpate.benchmarks._density_noise import coloured, whitened

USUAL = {
    "onset": 0.2e-3,  # m, first touch of a press
    "repeat": 0.01,  # share of the force, between presses of a place
    "stick": 0.1,  # share of the sideways force, of a press
    "turn": 0.05,  # rad, of the sideways force about the normal, of a press
    "rate": 1e-3,  # s, by which a press's force may come late
    "shape": 1.0,  # of what the surface's own uncertainty says, stiffness of a place
    "tilt": 0.03,  # rad, a place's normal
    "bend": 0.02,  # share by which a place's depth law bends
    "memory": 0.01,  # share of the force that a place may forget within MEMORY_S
    "region": 1.0,  # as shape, over a region
    "level": 0.1e-3,  # m, first touch over a region
}
FACTOR = 2.0
"""One standard deviation of what a recording may differ from the usual sizes, a factor."""
FLOOR = 1.2
"""Usual variance of what no name covers, beside noise of variance 1."""
FLOOR_FACTOR = 1.5
MEMORY_S = 0.3
REGION = 0.5
"""Reach of the random field, of the object's height."""
MODES = 6
"""Patterns of the random field that are kept, largest first."""

PRESS, PLACE, FIELD = range(3)


@dataclass(frozen=True)
class Column:
    """A way to be wrong: its component's name, its level (PRESS, PLACE), (n, 3) N a usual size of it."""

    name: str
    level: int
    change: np.ndarray


def own_errors(forward: Forward, settings: Settings, site_sd: np.ndarray) -> list[Column]:
    """The columns of presses and places at a prediction's settings. site_sd: (p,) of the stiffness."""
    t = forward.touches
    f = np.nan_to_num(forward.predict(settings))
    moved = forward.ideal(settings.modulus)
    moved.__dict__.update(settings.__dict__)
    small = 2e-5
    moved.onset = settings.onset + small
    slope = (np.nan_to_num(forward.predict(moved)) - f) / small
    late = delayed(t.parts, t.t, f, 1e-3) - f
    zero = np.zeros(len(f))
    depth = np.clip(t.travel[:, 0], 0, None) / np.maximum(t.deepest[t.press], 1e-4) - 0.7
    sd = site_sd[t.press][:, None]

    def column(name: str, level: int, change: np.ndarray) -> Column:
        return Column(name, level, USUAL[name] * change)

    return [
        column("onset", PRESS, slope),
        column("repeat", PRESS, f),
        column("stick", PRESS, np.column_stack([zero, f[:, 1], f[:, 2]])),
        column("turn", PRESS, np.column_stack([zero, -f[:, 2], f[:, 1]])),
        column("rate", PRESS, late * 1e3),
        column("shape", PLACE, f * sd),
        column("tilt", PLACE, np.column_stack([zero, f[:, 0], zero])),
        column("tilt", PLACE, np.column_stack([zero, zero, f[:, 0]])),
        column("bend", PLACE, f * depth[:, None]),
        column("memory", PLACE, _forgotten(forward, f)),
        column("region", FIELD, f * sd),
        column("level", FIELD, slope),
    ]


def _forgotten(forward: Forward, f: np.ndarray) -> np.ndarray:
    """(n, 3) N: force less its mean over the last MEMORY_S, exponentially weighed."""
    t = forward.touches
    out = np.empty_like(f)
    for part in t.parts:
        dt = np.diff(t.t[part], prepend=t.t[part][:1])
        keep = np.exp(-dt / MEMORY_S)
        mean = np.zeros(3)
        for i in range(part.start, part.stop):
            k = keep[i - part.start]
            mean = k * mean + (1 - k) * f[i]
            out[i] = f[i] - mean
    return out


def field_modes(forward: Forward) -> np.ndarray:
    """(s, m): patterns over the places of a field of variance 1 that reaches REGION of the height."""
    t = forward.touches
    reach = REGION * max(float(np.ptp(forward.places.height)), 1e-3)
    away = np.linalg.norm(t.site_point[:, None] - t.site_point[None], axis=2)
    value, vector = np.linalg.eigh(np.exp(-0.5 * (away / reach) ** 2))
    order = np.argsort(-value)[: min(MODES, max(t.sites // 3, 1))]
    return vector[:, order] * np.sqrt(np.maximum(value[order], 0.0))


@dataclass(frozen=True)
class Terms:
    """Inner products that a likelihood needs; g places, k parameters, m field patterns, q own errors.

    gram: (g, 1 + k + m + q, ...) of [residual, parameters, field, own errors], noise made white. rows: (g,)
    numbers in the residual. names: components. own: (g, q) component of each own error, -1 where there is
    none. field: (m,) component of each field pattern. pull, prior: (k,) gradient and precision of the
    parameters' own prior at the fit. low, high: (k,) how far each parameter may move.
    """

    gram: np.ndarray
    rows: np.ndarray
    names: tuple[str, ...]
    own: np.ndarray
    field: np.ndarray
    pull: np.ndarray
    prior: np.ndarray
    low: np.ndarray
    high: np.ndarray

    @property
    def k(self) -> int:
        """Parameters."""
        return len(self.prior)

    @property
    def fixed(self) -> int:
        """Parameters and field patterns."""
        return len(self.prior) + len(self.field)


def terms_of(
    forward: Forward,
    columns: list[Column],
    modes: np.ndarray,
    residual: np.ndarray,
    jacobian: np.ndarray,
    *,
    pull: np.ndarray,
    prior: np.ndarray,
    low: np.ndarray,
    high: np.ndarray,
) -> Terms:
    """Inner products place by place. residual: (n, 3) N with moved first touches put back; jacobian: (n, 3,
    k)."""
    t = forward.touches
    noise = coloured(t.noise, t.sample_rate_hz)
    names = tuple(dict.fromkeys(c.name for c in columns))
    site_of_row = t.site[t.press]
    waved = [c for c in columns if c.level == FIELD]
    m = modes.shape[1] * len(waved)
    grams, owns, rows = [], [], []
    for s in range(t.sites):
        own_rows = np.flatnonzero((site_of_row == s) & t.counted)
        stack = [residual[own_rows][:, :, None], jacobian[own_rows]]
        for c in waved:
            stack.append(c.change[own_rows][:, :, None] * modes[s])
        own: list[int] = []
        for c in columns:
            if c.level == PLACE:
                stack.append(c.change[own_rows][:, :, None])
                own.append(names.index(c.name))
            elif c.level == PRESS:
                each = np.flatnonzero(t.site == s)
                stack.append(c.change[own_rows][:, :, None] * (t.press[own_rows][:, None, None] == each))
                own += [names.index(c.name)] * len(each)
        x = np.concatenate(stack, axis=2)
        white = whitened(t, own_rows, x.reshape(len(own_rows), -1), noise).reshape(-1, x.shape[2])
        grams.append(white.T @ white)
        owns.append(own)
        rows.append(3 * len(own_rows))
    q = max(map(len, owns))
    first = 1 + jacobian.shape[2] + m
    gram = np.zeros((t.sites, first + q, first + q))
    whose = np.full((t.sites, q), -1)
    for s, gained in enumerate(grams):
        gram[s, : len(gained), : len(gained)] = gained
        whose[s, : len(owns[s])] = owns[s]
    field_of = np.repeat([names.index(c.name) for c in waved], modes.shape[1])
    return Terms(gram, np.array(rows), names, whose, field_of.astype(int), pull, prior, low, high)


@dataclass(frozen=True)
class Weighed:
    """Terms weighed by a covariance. inner: (g, 1 + k + m, ...) of [residual, parameters, field] in the
    inverse of each place's covariance. log_det: (g,) of these. precision, pull: (k + m,) priors of
    parameters and field. sizes: component -> its standard deviation over the usual. loss: minus log
    likelihood."""

    inner: np.ndarray
    log_det: np.ndarray
    precision: np.ndarray
    pull: np.ndarray
    sizes: dict[str, float]
    x: np.ndarray
    loss: float


def weigh(terms: Terms, x: np.ndarray) -> tuple[Weighed, np.ndarray]:
    """(weighed, gradient of the loss) at log variances x (1 + c,): of the noise, of each component."""
    f = terms.fixed
    eta = np.exp(x[0])
    variance = np.exp(x[1:])
    d = np.where(terms.own >= 0, np.sqrt(variance)[terms.own], 0.0)
    yy = terms.gram[:, : 1 + f, : 1 + f]
    ny = terms.gram[:, 1 + f :, : 1 + f] * d[:, :, None]
    nn = terms.gram[:, 1 + f :, 1 + f :] * d[:, :, None] * d[:, None, :]
    b = np.eye(d.shape[1]) + nn / eta
    inverse = np.linalg.inv(b)
    taken = inverse @ ny
    inner = (yy - np.swapaxes(ny, 1, 2) @ taken / eta) / eta
    log_det = terms.rows * np.log(eta) + np.linalg.slogdet(b)[1]
    precision = np.concatenate([terms.prior, 1 / variance[terms.field]])
    pull = np.concatenate([terms.pull, np.zeros(len(terms.field))])
    total = inner.sum(axis=0)
    a = total[1:, 1:] + np.diag(precision)
    a = a + 1e-10 * np.diag(np.diag(a) + 1e-12)
    v = np.linalg.inv(a)
    side = total[1:, 0] - pull
    delta = v @ side
    free = np.concatenate([[1.0], -delta])
    # own errors' means and variances, of unit prior
    mean = (taken @ free) / eta
    shift = taken[:, :, 1:] / eta
    spread = np.diagonal(inverse, axis1=1, axis2=2) + np.einsum("gqa,ab,gqb->gq", shift, v, shift)
    moved = np.where(terms.own >= 0, 0.5 * (mean**2 + spread - 1), 0.0)
    gradient = np.zeros(len(x))
    np.add.at(gradient[1:], terms.own[terms.own >= 0], moved[terms.own >= 0])
    k = terms.k
    waves = 0.5 * ((delta[k:] ** 2 + np.diag(v)[k:]) / variance[terms.field] - 1)
    np.add.at(gradient[1:], terms.field, waves)
    left = np.einsum("i,gij,j->g", free, yy, free) - 2 * np.einsum("gq,gqi,i->g", mean, ny, free)
    left = left + np.einsum("gq,gqr,gr->g", mean, nn, mean) + np.einsum("gqr,grq->g", nn, inverse)
    left = left.sum() + eta * np.einsum("ab,ba->", v, total[1:, 1:])
    gradient[0] = 0.5 * (left / eta - terms.rows.sum())
    quadratic = total[0, 0] - side @ delta
    waved = -0.5 * np.log(variance[terms.field]).sum()
    likelihood = -0.5 * (log_det.sum() + quadratic + np.linalg.slogdet(a)[1]) + waved
    width = np.full(len(x), 2 * np.log(FACTOR))
    width[0] = np.log(FLOOR_FACTOR)
    centre = np.zeros(len(x))
    centre[0] = np.log(FLOOR)
    likelihood -= 0.5 * (((x - centre) / width) ** 2).sum()
    gradient -= (x - centre) / width**2
    sizes = dict(zip(terms.names, np.sqrt(variance).tolist(), strict=True))
    return Weighed(inner, log_det, precision, pull, sizes, x, -float(likelihood)), -gradient


def estimated(terms: Terms, start: np.ndarray | None = None, iterations: int = 20) -> Weighed:
    """The terms weighed by the likeliest variances. start: log variances to begin with."""
    if start is None:
        start = np.zeros(1 + len(terms.names))
        start[0] = np.log(FLOOR)

    def loss(x: np.ndarray) -> tuple[float, np.ndarray]:
        weighed, gradient = weigh(terms, x)
        return weighed.loss, gradient

    bounds = [(-1.0, 4.0)] + [(-8.0, 8.0)] * len(terms.names)
    found = minimize(
        loss, start, jac=True, method="L-BFGS-B", bounds=bounds, options={"maxiter": iterations, "ftol": 1e-7}
    )
    return weigh(terms, found.x)[0]
