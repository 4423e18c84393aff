"""Forms of a cause: what each of them does to a prediction, over its parameters and places.

What evidence is weighed from: every form of a cause as a change of force, beside noise and our own errors.

The likelihood is Gaussian and linear about the ideal model: the modulus is free; first touches, places and
the law's own errors (those of one place and those that all places share) have widths of their own
(mechanics.law_errors, diagnose.search.whiten); every form of a cause is a column, the change of force that it
brings about.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from palpate.diagnosis.explore.estimate import ExplorationEstimate, solved_sites
from palpate.diagnosis.explore.felt import MESH_M
from palpate.diagnosis.forward.prediction import Forward
from palpate.diagnosis.forward.touches import reached, touches_of, unobservable_effects
from palpate.diagnosis.instrument.free_air import free_air_of
from palpate.diagnosis.instrument.instrument_effects import find_instrument_offsets
from palpate.diagnosis.instrument.support_readings import rigid_of
from palpate.diagnosis.options import NuisanceOptions
from palpate.diagnosis.search.descent import first_touches, fit
from palpate.diagnosis.search.fit import Fit, settings_of
from palpate.diagnosis.search.gaps import beside_modulus_n
from palpate.diagnosis.search.site_stiffness import surface_error
from palpate.diagnosis.search.whiten import Whitener
from palpate.mechanics.compliance.far_field import energy_fields
from palpate.mechanics.compliance.pressed_places import places_at
from palpate.mechanics.effects.base import Effect, Role
from palpate.mechanics.effects.registry import effects
from palpate.mechanics.effects.settings import ForwardSettings
from palpate.mechanics.law_errors import (
    DepthLaw,
    Direction,
    FiniteStrain,
    FirstTouch,
    Latency,
    Slip,
    Stiffness,
    Unnamed,
)
from palpate.mechanics.model.material import ObjectMaterial
from palpate.mechanics.model.model import Model, Support, Tool
from palpate.mechanics.presses.table import Presses
from palpate.mechanics.statistics import squared_exponential
from palpate.reconstruction.steps.s5_mesh.meshing import uncertainty_at

Act = Callable[[ForwardSettings, Forward], None]
"""Sets one form of a cause in a prediction."""
SHARES = (0.3, 1.0, 3.0)
"""Steps from where an effect does nothing, of its starts, at which its form is taken."""
MOVES = 5
"""Steps of a parameter that is moved from where it does nothing."""
BALL_GRID_M, BALL_RADII_M, BALL_SHARE = 0.014, (0.008, 0.012), 0.5
"""Balls that are weighed: apart, radii, and the share by which a form is softer."""


def causes_tried(presses: Presses) -> list[Effect]:
    """Effects that may be the cause: those that a quick diagnosis searches for and such presses show, but for
    what can take the form of others."""
    unobservable = unobservable_effects(presses)
    able = [e for e in effects() if e.role is Role.SEARCHED and e.name not in unobservable]
    return [e for e in able if not (e.hints.any_form or e.hints.expensive)]


def forms_of(forward: Forward) -> list[tuple[str, Act]]:
    """(name, act) pairs: every form of each cause but the inclusion, whose places the object gives."""
    forms: list[tuple[str, Act]] = []
    laws: dict[str, str] = {}
    for each in causes_tried(forward.touches):
        # of the laws of one phenomenon the first stands for all
        name = laws.setdefault(each.hints.phenomenon, each.name) if each.hints.phenomenon else each.name
        if each.hints.seek is None:
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


def softer(compliance: np.ndarray) -> Act:
    def act(settings: ForwardSettings, scene: Forward) -> None:
        settings.far = settings.far.copy()
        settings.far[:, 0, 0] += compliance

    return act


LEAST_PRESSES = 6
SUPPORT_GIVES = 1.5e-5
"""m/N, standard deviation of what a support or its tracing seems to yield by itself."""
NUISANCE = NuisanceOptions(floor_share=Unnamed.share_exploring.value, latency_s=0.0).each_by_itself()
"""As a diagnosis has them, but that 'none' holds what is small against the force already, that a running
surface is not yet fitted so well, and that `common_errors` are what presses share."""
LITTLE = 0.1
"""1/m, of compliance for unit modulus, small against a place's own (some 10)."""


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

    def inflation(self, misfit: float) -> float:
        """By how much a log likelihood counts too much: slow noise, and a lack of fit above 1."""
        return self.forward.touches.noise.variance_inflation * max(1.0, misfit)


def weigh(estimate: ExplorationEstimate) -> Weighing | None:
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
    answer = (changed(forward, found, softer(little)) - before) / LITTLE
    for compliance in balls(forward):
        # small against the whole: as much of one press's answer as there is more compliance
        names.append("inclusion")
        acts.append(softer(compliance))
        changes.append(answer * compliance[forward.touches.press][:, None])
        springs.append(0.0)
    columns = np.stack([residual, before, *own, *changes], axis=2)
    gram = whitener.gram(columns).sum(axis=0)
    counted = forward.touches.counted
    plain = before[counted]
    sizes = np.array([beside_modulus_n(c[counted], plain) for c in changes])
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
    tails = FirstTouch.tails.value
    return np.sqrt((tails * usual_m**2 + onset**2) / (tails + 1))


def _spring(forward: Forward, found: Fit, act: Act) -> float:
    """m/N, by which a form lets the tool yield."""
    settings = settings_of(forward, (), found.values, found.onset)
    act(settings, forward)
    return float(settings.tool_compliance)


def _on_support(estimate: ExplorationEstimate) -> tuple[float, float] | None:
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


def forward_of(estimate: ExplorationEstimate) -> tuple[Forward, np.ndarray] | None:
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
    forward = Forward(touches, places_at(model, touches, sites))
    if e.exploration is not None:
        # bias, drift and the tool's weight are read in free air, not in presses
        free = free_air_of(e.exploration.recording, e.presses_placed)
        find_instrument_offsets(forward, free, None, set())
    of_law, of_surface = NUISANCE.site_stiffness, Stiffness.running_surface.value * surface_error(forward)
    return forward, np.hypot(of_law, of_surface)


def _model(e: ExplorationEstimate, presses: Presses) -> Model:
    assert e.solved is not None and e.surface is not None and e.sites is not None and e.fit is not None
    mesh = e.solved.mesh.quadratic()
    return Model(
        mesh=mesh,
        material=ObjectMaterial(e.fit.modulus_pa, e.sites.poisson_ratio),
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

    def moved(change: ForwardSettings) -> np.ndarray:
        return np.nan_to_num(forward.predict(change)) - before

    settings = settings_of(forward, (), found.values, found.onset)
    settings.onset = settings.onset + FirstTouch.common.value
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
        before * (bend * DepthLaw.common.value)[:, None],
        sideways * Slip.common.value,
        late * Latency.common.value,
        moved(settings),
        moved(strain) * FiniteStrain.common.value,
        *(Direction.turned.value * each for each in turned),
        Direction.upward.value * up * before[:, :1],
        *(before * column[t.press][:, None] for column in field.T),
    ]


def _field(points: np.ndarray, site_sd: np.ndarray) -> np.ndarray:
    """(p, p) covariance of the share by which the stiffness of places (p, 3) m is off."""
    squared = ((points[:, None] - points[None]) ** 2).sum(axis=2)
    return np.outer(site_sd, site_sd) * squared_exponential(squared, Stiffness.shared_over.value)
