"""The standing of every cause after each press, so that one may look whenever one likes.

Each cause is a hypothesis with a fixed prior over its forms and sizes, 'none' among them, and the evidence
for it is its marginal likelihood M of all that was felt. Under hypothesis r the ratio of the mean of all M to
M_r is a martingale that starts at 1 (the prior-posterior ratio; Robbins 1970, Waudby-Smith & Ramdas 2020), so
by Ville's inequality it ever exceeds 1 / alpha with a probability of at most alpha. What has not fallen below
alpha times the mean is the set of causes: whatever is true stays in it through the whole exploration with
probability 1 - alpha, however often one looks, and whenever one stops.

'None' is not nothing: it is every cause at every size that is too small to matter, so that an error of our
own law, which many presses show ever more plainly, rules it out only once it is a gap that one would feel.

The likelihood is Gaussian and linear about the ideal model: the modulus is free; first touches, places and
the law's own errors (those of one place and those that all places share) have widths of their own
(diagnose.search.whiten, COMMON); every form of a cause is a column, the change of force that it brings about.
The log likelihood is divided by what slow noise adds and by the lack of fit that the best cause leaves
(never less than 1): a power of a likelihood below 1 keeps the inequality (Jensen), and pays for a law that
is not exact.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from diagnose.explore.estimate import MESH_M, Estimate, solved_sites
from diagnose.forward.prediction import Forward
from diagnose.forward.touches import touches_of, unobservable_effects
from diagnose.instrument.free_air import free_air_of
from diagnose.instrument.offsets import find_instrument_offsets
from diagnose.instrument.rigid import rigid_of
from diagnose.options import AttributionOptions, NuisanceOptions
from diagnose.search.fit import Fit, fit, settings_of
from diagnose.search.shape import site_stiffness_sd
from diagnose.search.starts import first_touches, reached
from diagnose.search.whiten import Whitener
from mechanics.effects.base import Effect, Role
from mechanics.effects.registry import effect, effects
from mechanics.effects.settings import Settings
from mechanics.far_field import energy_fields
from mechanics.material import Material
from mechanics.model import Model, Support, Tool
from mechanics.places import Places
from mechanics.presses import Presses
from reconstruct.steps.s5_mesh.meshing import uncertainty_at

NONE = "none"
FALSE_ALARMS = 0.02
"""Probability of ruling 'none' out at any time where it is true."""
LEAST_PRESSES = 6
SIZES = np.geomspace(1.0, 100.0, 13)
"""Sizes of a cause that are weighed, times `least_n`."""
SMALL = np.linspace(0.0, 1.0, 5)
"""Sizes that are none, times `least_n`: what is too small to matter, a cause or an error of ours alike."""
LEAST_SHARE = 0.01
"""Of the force: a smaller change does not matter, however plainly many presses show it."""
SHARES = (0.3, 1.0, 3.0)
"""Steps from where an effect does nothing, of its starts, at which its form is taken."""
SUPPORT_GIVES = 1.5e-5
"""m/N, standard deviation of what a support or its tracing seems to yield by itself."""
MOVES = 5
"""Steps of a parameter that is moved from where it does nothing."""
COMMON = {
    "bend": 0.03, "sideways": 0.15, "late": 0.0005, "onset": 0.05e-3, "strain": 0.6, "turned": 0.02,
    "upward": 0.03,
}  # fmt: skip
"""Standard deviations of errors of our own that all places share: share by which the law of depth bends
wrongly; share of the sideways force; s by which the force is late; m of all first touches; share of finite
strain; rad by which forces are turned about each axis of the device; share of the push that goes up or down
along the surface."""
TAILS = 3.0
"""Degrees of freedom of the running shape's error at a touch."""
NUISANCE = NuisanceOptions(floor_share=0.0)
"""As a diagnosis has them, but that 'none' holds what is small against the force already."""
FIELD_M = 0.03
"""Distance over which neighbours share what a place's stiffness may be off by."""
BALL_GRID_M, BALL_RADII_M, BALL_SHARE = 0.014, (0.008, 0.012), 0.5
"""Balls that are weighed: apart, radii, and the share by which a form is softer."""
LITTLE = 0.1
"""1/m, of compliance for unit modulus, small against a place's own (some 10)."""
TWO_SIGNED = frozenset({"inclusion"})
"""A form of which may as well be the other way round."""


@dataclass(frozen=True)
class Causes:
    """What stands after the presses so far.

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

    def standing(self, at: float) -> list[str]:
        """Hypotheses that are not ruled out, the likeliest first; each true one stays in with probability
        `at`, 'none' with 1 - FALSE_ALARMS."""
        ratio = self.ratio
        left = [n for n, r in ratio.items() if r > (min(1 - at, FALSE_ALARMS) if n == NONE else 1 - at)]
        return sorted(left, key=lambda n: -ratio[n])

    def table(self, at: float) -> dict[str, object]:
        """As JSON has it."""
        return {
            "standing": self.standing(at),
            "probability": self.probability,
            "ratio": self.ratio,
            "least_n": self.least_n,
            "misfit": self.misfit,
        }


def prior_of(names: Sequence[str]) -> np.ndarray:
    """(k,) half for 'none', the rest evenly for the causes."""
    each = 0.5 / max(len(names) - 1, 1)
    return np.array([0.5 if n == NONE else each for n in names])


Act = Callable[[Settings, Forward], None]
"""Sets one form of a cause in a prediction."""


@dataclass(frozen=True)
class Weighing:
    """What the evidence comes from: forward model, its nuisances, base fit; acts, names, sizes (f,): of the
    forms, what each does, its cause, and N, rms of its change of force beside the modulus. gram (k, k):
    whitened and summed over sites, of the residual, the modulus, `own` common errors, then the forms. dof:
    readings. site_sd: (p,) share by which each place's stiffness may be off. springs: (f,) m/N by which a
    form lets the tool yield; on_support: the same as read off the rigid support, and its standard error."""

    forward: Forward
    whitener: Whitener
    found: Fit
    acts: tuple[Act, ...]
    names: tuple[str, ...]
    sizes: np.ndarray
    gram: np.ndarray
    own: int
    dof: float
    site_sd: np.ndarray
    springs: np.ndarray
    on_support: tuple[float, float] | None


def causes_of(estimate: Estimate, least_n: float | None = None) -> tuple[Causes, Weighing] | None:
    """None with fewer presses than LEAST_PRESSES, or without a surface."""
    weighing = weigh(estimate)
    if weighing is None:
        return None
    least = least_n or least_that_matters(weighing.forward)
    causes = judge(weighing, least)
    return causes, weighing


def least_that_matters(forward: Forward) -> float:
    """N rms over contact samples: the smallest gap that a diagnosis names, or LEAST_SHARE of the force."""
    t = forward.touches
    return max(AttributionOptions().smallest * t.vector_noise_n, LEAST_SHARE * t.force_rms_n)


def weigh(estimate: Estimate) -> Weighing | None:
    """All columns of evidence at the present estimate."""
    scene = forward_of(estimate)
    if scene is None:
        return None
    forward, site_sd = scene
    assert estimate.fit is not None
    modulus = estimate.fit.modulus_pa
    whitener = Whitener(forward, forward.ideal(modulus), NUISANCE, site_sd)
    onset = first_touches(forward, whitener, modulus)
    found = fit(forward, whitener, [], modulus=modulus, onset=onset, iterations=6)
    settings = settings_of(forward, (), found.values, found.onset)
    onset_sd = first_touch_sd(found.onset, NUISANCE.onset_m)
    whitener = Whitener(forward, settings, NUISANCE, site_sd, onset_sd)
    before = np.nan_to_num(forward.predict(settings))
    residual = forward.touches.local_force - before
    residual = residual + whitener.onset_column * found.onset[forward.touches.press][:, None]
    own = common_errors(forward, found, before, site_sd)
    names, acts, changes, springs = [], [], [], []
    for name, act in forms_of(forward):
        change = changed(forward, found, act) - before
        if np.abs(change).max() > 0:
            names.append(name)
            acts.append(act)
            changes.append(change)
            springs.append(_spring(forward, found, act))
    little = np.full(len(forward.touches), LITTLE)
    answer = (changed(forward, found, _softer(little)) - before) / LITTLE
    for compliance in balls(forward):
        # small against the whole: as much of one press's answer as there is more compliance
        names.append("inclusion")
        acts.append(_softer(compliance))
        changes.append(answer * compliance[forward.touches.press][:, None])
        springs.append(0.0)
    columns = np.stack([residual, before, *own, *changes], axis=2)
    gram = whitener.gram(columns).sum(axis=0)
    counted = forward.touches.counted
    plain = before[counted]
    sizes = np.array([_size(c[counted], plain) for c in changes])
    dof = 3.0 * float(counted.sum())
    return Weighing(
        forward, whitener, found, tuple(acts), tuple(names), sizes, gram, len(own), dof, site_sd,
        np.array(springs), _on_support(estimate),
    )  # fmt: skip


def first_touch_sd(onset: np.ndarray, usual_m: float) -> np.ndarray:
    """(p,) m, standard deviation of each first touch, given where it lies (p,) m from its place: of Student's
    t, as a mixture of Gaussians, the one that it then came from.

    A running shape passes single touches by millimetres (an edge, a face that nobody touched yet); as
    Gaussians of the usual width these would rule out every hypothesis but one that moves them.
    """
    return np.sqrt((TAILS * usual_m**2 + onset**2) / (TAILS + 1))


def _spring(forward: Forward, found: Fit, act: Act) -> float:
    """m/N, by which a form lets the tool yield."""
    settings = settings_of(forward, (), found.values, found.onset)
    act(settings, forward)
    return float(settings.tool_compliance)


def _on_support(estimate: Estimate) -> tuple[float, float] | None:
    """(m/N by which the tip yields against the rigid support, standard error), where that was touched."""
    exploration, surface = estimate.exploration, estimate.surface
    if exploration is None or surface is None:
        return None
    rigid = rigid_of(exploration.recording, exploration.presses, surface.support_normal)
    if rigid is None:
        return None
    return rigid.compliance, float(np.hypot(rigid.error, SUPPORT_GIVES))


def changed(forward: Forward, found: Fit, act: Act | None) -> np.ndarray:
    """(n, 3) N, local frames: the prediction at a fit, with a form of a cause or without."""
    settings = settings_of(forward, (), found.values, found.onset)
    if act is not None:
        act(settings, forward)
    return np.nan_to_num(forward.predict(settings))


def _size(change: np.ndarray, plain: np.ndarray) -> float:
    beyond = change - (change * plain).sum() / max((plain**2).sum(), 1e-300) * plain
    return float(np.sqrt((beyond**2).sum(axis=1).mean()))


def forward_of(estimate: Estimate) -> tuple[Forward, np.ndarray] | None:
    """(forward model of the presses so far, (p,) share by which each place's stiffness may be off); on the
    running estimate's own mesh and solved places. Presses that the running surface passes by more than a
    first touch can be moved are left out: they lie on a shape that is not there yet."""
    e = estimate
    if e.solved is None or e.presses_placed is None or e.fit is None or e.surface is None:
        return None
    placed = e.presses_placed
    placed = placed.of(reached(placed))
    if len(placed) < LEAST_PRESSES:
        return None
    touches = touches_of(placed)
    model = _model(estimate, touches)
    sites, _ = solved_sites(e.solved, touches.point, touches.normal, model.material.poisson_ratio)
    far = np.einsum("pij,pjk,plk->pil", touches.frame, sites.far, touches.frame)
    places = Places(
        model, touches.point, touches.normal, touches.frame, np.ascontiguousarray(far), sites.curvature
    )
    forward = Forward(touches, places)
    if e.exploration is not None:
        # bias, drift and the tool's weight are told by free air, not by presses
        free = free_air_of(e.exploration.recording, e.presses_placed)
        find_instrument_offsets(forward, free, None, set())
    return forward, site_stiffness_sd(touches, model, NUISANCE)


def _model(e: Estimate, presses: Presses) -> Model:
    assert e.solved is not None and e.surface is not None and e.sites is not None and e.fit is not None
    mesh = e.solved.mesh.quadratic()
    return Model(
        mesh=mesh,
        material=Material(e.fit.modulus_pa, e.sites.poisson_ratio),
        support=Support(e.surface.support_point, e.surface.support_normal),
        tool=Tool(presses.tip_radius_m),
        mesh_size_m=MESH_M,
        shape_uncertainty_m=uncertainty_at(mesh, e.surface),
        presses=presses,
    )


def common_errors(forward: Forward, found: Fit, before: np.ndarray, site_sd: np.ndarray) -> list[np.ndarray]:
    """(n, 3) N each: one standard deviation of what our own law gets wrong at all places alike, or at
    neighbours; site_sd: (p,) share by which each place's stiffness may be off."""
    t = forward.touches
    deepest = np.maximum(t.deepest[t.press], 1e-4)
    bend = np.clip(t.travel[:, 0], 0, None) / deepest - 0.7
    sideways = before.copy()
    sideways[:, 0] = 0.0

    def moved(change: Settings) -> np.ndarray:
        return np.nan_to_num(forward.predict(change)) - before

    settings = settings_of(forward, (), found.values, found.onset)
    settings.onset = settings.onset + COMMON["onset"]
    late = np.zeros_like(before)
    for part in t.parts:
        if part.stop - part.start > 2:
            late[part] = -np.gradient(before[part], t.t[part], axis=0)
    strain = settings_of(forward, (), found.values, found.onset)
    known = next(e for e in effects() if e.role is Role.KNOWN)
    known.act(strain, known.ideal, forward)
    frame = t.frame[t.press]
    device = np.einsum("nji,nj->ni", frame, before)
    turned = [np.einsum("nij,nj->ni", frame, np.cross(axis, device)) for axis in np.eye(3)]
    up = np.einsum("nij,j->ni", frame, forward.model.support.normal)
    up[:, 0] = 0.0
    field = np.linalg.cholesky(_field(t.point, site_sd) + 1e-9 * np.eye(len(t)))
    return [
        before * (bend * COMMON["bend"])[:, None],
        sideways * COMMON["sideways"],
        late * COMMON["late"],
        moved(settings),
        moved(strain) * COMMON["strain"],
        *(COMMON["turned"] * each for each in turned),
        COMMON["upward"] * up * before[:, :1],
        *(before * column[t.press][:, None] for column in field.T),
    ]


def _field(points: np.ndarray, site_sd: np.ndarray) -> np.ndarray:
    """(p, p) covariance of the share by which the stiffness of places (p, 3) m is off."""
    squared = ((points[:, None] - points[None]) ** 2).sum(axis=2)
    return np.outer(site_sd, site_sd) * np.exp(-squared / (2 * FIELD_M**2))


def tried(presses: Presses) -> list[Effect]:
    """Effects that may be the cause: those that a quick diagnosis searches for and such presses tell, but for
    what can take the form of others."""
    untold = unobservable_effects(presses)
    able = [e for e in effects() if e.role is Role.SEARCHED and not e.any_form and not e.costly]
    return [e for e in able if e.name not in untold]


def forms_of(forward: Forward) -> list[tuple[str, Act]]:
    """(name, act) pairs: every form of each cause but the inclusion, whose places the object gives."""
    forms: list[tuple[str, Act]] = []
    laws: dict[str, str] = {}
    for each in tried(forward.touches):
        # of the laws of one phenomenon the first stands for all
        name = laws.setdefault(each.phenomenon, each.name) if each.phenomenon else each.name
        if each.seek is None:
            forms += [(name, _acting(each, values)) for values in _values(each)]
    return forms


def _acting(each: Effect, values: np.ndarray) -> Act:
    return lambda settings, scene: each.act(settings, values, scene)


def _values(each: Effect) -> list[np.ndarray]:
    """Of its forms: steps towards its starts, and of what starts where it does nothing each parameter moved,
    up and down."""
    low, high = each.bounds
    made: dict[bytes, np.ndarray] = {}
    for start in each.starts():
        towards = [share * (start - each.ideal) for share in SHARES]
        if not (start - each.ideal).any():
            steps = np.diag([MOVES * p.step for p in each.parameters])
            towards = [*steps, *(-steps)]
        for way in towards:
            value = np.clip(each.ideal + way, low, high)
            made.setdefault(value.round(9).tobytes(), value)
    return list(made.values())


def balls(forward: Forward) -> list[np.ndarray]:
    """(p,) 1/m each: by how much more each place gives, unit modulus, over a softer ball on a grid inside the
    object; to first order in its energy."""
    places = forward.places
    fields = energy_fields(places)
    low, high = fields.centroid.min(axis=0), fields.centroid.max(axis=0)
    axes = [np.arange(a + BALL_GRID_M / 2, b, BALL_GRID_M) for a, b in zip(low, high, strict=True)]
    centres = np.array(np.meshgrid(*axes, indexing="ij")).reshape(3, -1).T
    made = []
    for centre in centres:
        away = np.linalg.norm(fields.centroid - centre, axis=1)
        if away.min() > 0.5 * BALL_GRID_M:
            continue
        for radius in BALL_RADII_M:
            share = np.clip((radius - away) / 0.004 + 0.5, 0.0, 1.0)
            made.append(BALL_SHARE * (fields.energy[:, :, 0, 0] @ share)[places.place])
    return made


def _softer(compliance: np.ndarray) -> Act:
    def act(settings: Settings, scene: Forward) -> None:
        settings.far = settings.far.copy()
        settings.far[:, 0, 0] += compliance

    return act


def judge(weighing: Weighing, least_n: float) -> Causes:
    """The evidence of every cause, and of none."""
    w = weighing
    names = [NONE, *dict.fromkeys(w.names)]
    target, curve, fitted = projected(w)
    explained = np.where(curve > 0, target**2 / np.maximum(curve, 1e-300), 0.0)
    misfit = (fitted - explained.max(initial=0.0)) / w.dof
    target, curve = with_support(w, target, curve)
    over = w.forward.touches.noise.variance_inflation * max(1.0, misfit)
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
    """The same products with what the rigid support tells: a yielding tool shows there by itself."""
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
    """Log likelihood ratios to the ideal model of the forms `rows` at all sizes (k,) N, both signs where it
    has both."""
    size = np.maximum(w.sizes[rows], 1e-9)
    factor = sizes_n[None] / size[:, None]
    signs = (1.0, -1.0) if w.names[rows[0]] in TWO_SIGNED else (1.0,)
    log = [s * factor * target[rows, None] - 0.5 * factor**2 * curve[rows, None] for s in signs]
    return np.concatenate(log).ravel() / over


def _log_mean(log: np.ndarray) -> float:
    return float(np.logaddexp.reduce(log) - np.log(len(log)))


SEEN = 4.7
"""Standard deviations from which an effect shows (diagnose.search.detectable)."""


def detectable_n(weighing: Weighing) -> dict[str, float]:
    """{cause: N rms over contact samples beside the modulus} of the smallest size that shows in these
    presses, in the form that shows best, and matters."""
    _, curve, _ = projected(weighing)
    inflation = weighing.forward.touches.noise.variance_inflation
    shows = SEEN * np.sqrt(inflation) * weighing.sizes / np.sqrt(np.maximum(curve, 1e-300))
    matters = least_that_matters(weighing.forward)
    names = dict.fromkeys(weighing.names)
    return {n: max(matters, float(shows[[m == n for m in weighing.names]].min())) for n in names}


def words(name: str) -> str:
    """What a cause is called among words."""
    if name == NONE:
        return "nothing but the ideal model"
    return effect(name).plain_words or name.replace("_", " ")
