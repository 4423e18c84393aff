"""FEM against the interpolated 1D models on presses that none of them has seen: folds over sites, whole
regions.

Every model (diagnose.compare.models), and a simulator that is set beside them, is fitted to the same
training presses and predicts the same held-out paths, measured from the same first touches, at the same
places with the same normals; of the model only the geometry is used. Of a simulator the modulus is fitted:
its force, run along the path once, goes with it.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace

import numpy as np

from palpate.diagnosis.compare.models import RIVALS, Fem, Prepared, predicted, prepare
from palpate.mechanics.compliance.smooth_field import SmoothField
from palpate.mechanics.errors import ContactError
from palpate.mechanics.model.model import Model
from palpate.mechanics.one_thread import one_thread
from palpate.mechanics.options import EXACT, option
from palpate.mechanics.presses.table import Presses
from palpate.mechanics.progress import Progress, part, silent
from palpate.mechanics.recording.recording import Recording
from palpate.mechanics.result import Result
from palpate.reconstruction.pipeline import ReconstructOptions, reconstruct_fully
from palpate.reconstruction.presses_on_model import presses_on
from palpate.render.replay import rms_n

Predict = Callable[[np.ndarray, np.ndarray], tuple[dict[str, np.ndarray], Fem]]
"""(training presses, held-out presses) to each model's forces (rows of the held-out, 3), N, and the FEM."""
LEAST_HELD, LEAST_SEEN = 2, 4  # presses; smaller regions say nothing


@dataclass(frozen=True)
class CompareOptions:
    """How presses are held out."""

    folds: int = option(8, "parts that the sites are split into")
    site_m: float | None = option(
        None, "presses closer than this are one site; None: as reconstructed", unit="m", flag="--site-size"
    )
    interpolation: str = option("rbf", "interpolation of the 1D parameters", choices=("rbf", "nearest"))
    field: str = option(
        "auto",
        "a field of the modulus in the FEM: where the presses show one, or never",
        choices=("auto", "homogeneous"),
    )
    first_touch: str = option(
        "read",
        "first touch of held-out presses: as read, or moved by what its stated error allows, for every "
        "model alike",
        choices=("read", "moved"),
    )
    exact: bool = option(False, EXACT)


@dataclass(frozen=True)
class Along:
    """Another simulator's force on the tool, (n, 3) N, at times t (n,) s of the recording."""

    t: np.ndarray
    force: np.ndarray

    def at(self, t: np.ndarray) -> np.ndarray:
        """(m, 3) N, straight lines between samples."""
        return np.column_stack([np.interp(t, self.t, f) for f in self.force.T])


@dataclass(frozen=True)
class RegionResult:
    """Errors over the presses of one region, fitted on all the others.

    rmse_n: N. bias: share by which the predicted force is too large (-0.5: half as stiff as the object).
    """

    region: HeldOutRegion
    rmse_n: dict[str, float]
    relative_rmse: dict[str, float]
    bias: dict[str, float]


@dataclass(frozen=True, eq=False, repr=False)
class Comparison(Result):
    """Held-out rms force errors, N: rmse_n, relative_rmse by model.

    press_rmse_n: model -> (p,); fold: (p,); moduli_pa: (folds,) of the FEM. fields: of the modulus, in each
    fold that asked for one, else None. recording: what was compared on; None for presses that came without.
    `plot`: the error of every held-out press. `show`: the object, each press coloured by the FEM's error.
    """

    prepared: Prepared
    model: Model
    rmse_n: dict[str, float]
    relative_rmse: dict[str, float]
    press_rmse_n: dict[str, np.ndarray]
    fold: np.ndarray
    moduli_pa: np.ndarray
    fields: tuple[SmoothField | None, ...]
    noise_n: float
    predicted: dict[str, np.ndarray]
    regions: tuple[RegionResult, ...] = field(default_factory=tuple)
    recording: Recording | None = None

    @property
    def presses(self) -> Presses:
        """Contact samples of all presses; force net of free air."""
        return self.prepared.presses

    @property
    def constant_n(self) -> float:
        """rms error, N, of the ceiling: a constant push along the normal, the mean of the other folds', at
        every depth."""
        presses = self.presses
        normal = presses.normal[presses.press]
        push = np.einsum("ij,ij->i", presses.force, normal)
        fold = self.fold[presses.press]
        total, count = np.bincount(fold, weights=push), np.bincount(fold)
        others = (push.sum() - total) / np.maximum(len(push) - count, 1)
        return rms_n(others[fold, None] * normal - presses.force)

    @property
    def normal_rmse_n(self) -> dict[str, float]:
        """rms error, N, along the outward normal alone: 1D models have no other force."""
        normal = self.presses.normal[self.presses.press]
        off = {m: np.einsum("ij,ij->i", f - self.presses.force, normal) for m, f in self.predicted.items()}
        return {m: float(np.sqrt((along**2).mean())) for m, along in off.items()}

    def wins(self, name: str) -> int:
        """On how many held-out presses the model errs least."""
        names = ("fem", *RIVALS)
        table = np.array([self.press_rmse_n[m] for m in names])
        return int((table.argmin(axis=0) == names.index(name)).sum())


@one_thread
def compare(
    recording: Recording,
    model: Model | None = None,
    options: CompareOptions | None = None,
    *,
    simulated: Mapping[str, Along] | None = None,
    seed: int = 0,
    progress: Progress = silent,
) -> Comparison:
    """Compare on one recording; without a model its geometry is reconstructed. simulated: other simulators'
    forces along the recorded path, by name. Raises ContactError for fewer sites than two."""
    options = options or CompareOptions()
    if model is None:
        made = reconstruct_fully(recording, ReconstructOptions(seed=seed), part(progress, 0.0, 0.4))
        model, progress = made.model, part(progress, 0.4, 1.0)
    found = compare_presses(
        presses_on(recording, model), model, options, simulated=simulated, seed=seed, progress=progress
    )
    return replace(found, recording=recording)


def compare_presses(
    table: Presses,
    model: Model,
    options: CompareOptions | None = None,
    *,
    simulated: Mapping[str, Along] | None = None,
    seed: int = 0,
    progress: Progress = silent,
) -> Comparison:
    """`compare` on a table of presses that touch the model. Raises ContactError for fewer sites than two."""
    options = options or CompareOptions()
    prepared = prepare(
        table, model, options.site_m, part(progress, 0.0, 0.3), field=options.field, exact=options.exact
    )
    presses = prepared.presses

    others = {name: given.at(presses.t) for name, given in (simulated or {}).items()}

    def predict(train: np.ndarray, test: np.ndarray) -> tuple[dict[str, np.ndarray], Fem]:
        forces, fem = predicted(prepared, train, test, options.interpolation, options.first_touch)
        for name, own in others.items():
            forces[name] = own[presses.rows(test)] * _scale(own, presses, train)
        return forces, fem

    fold = _folds(presses.site, options.folds, seed)
    forces, fitted = _by_fold(presses, fold, predict, part(progress, 0.3, 0.7))
    held_out = tuple(_by_region(presses, model, predict, part(progress, 0.7, 1.0)))
    error = {m: forces[m] - presses.force for m in forces}
    each = {
        m: np.array([rms_n(error[m][presses.rows(np.array([i]))]) for i in range(len(presses))])
        for m in error
    }
    return Comparison(
        prepared=prepared,
        model=model,
        rmse_n={m: rms_n(error[m]) for m in error},
        relative_rmse={m: rms_n(error[m]) / rms_n(presses.force) for m in error},
        press_rmse_n=each,
        fold=fold,
        moduli_pa=np.array([fem.modulus_pa for fem in fitted]),
        fields=tuple(fem.field for fem in fitted),
        noise_n=presses.noise.raw_n * np.sqrt(3.0),
        predicted=forces,
        regions=held_out,
    )


def _scale(force: np.ndarray, presses: Presses, train: np.ndarray) -> float:
    """What a simulator's modulus is multiplied by, to fit the training presses: its force goes with it."""
    rows = presses.rows(train)
    square = float((force[rows] ** 2).sum())
    return float((force[rows] * presses.force[rows]).sum()) / square if square > 0 else 0.0


def _folds(site: np.ndarray, most: int, seed: int) -> np.ndarray:
    """(p,) the fold of each press; presses of one site are held out together."""
    sites = np.unique(site)
    folds = min(most, len(sites))
    if folds < 2:
        raise ContactError(
            f"{len(sites)} site was palpated: a comparison holds some out and needs at least 2"
        )
    fold_of_site = np.random.default_rng(seed).permutation(np.arange(len(sites)) % folds)
    return fold_of_site[np.searchsorted(sites, site)]


def _by_fold(
    presses: Presses, fold: np.ndarray, predict: Predict, progress: Progress
) -> tuple[dict[str, np.ndarray], list[Fem]]:
    """({model: (n, 3) N, every press predicted when its fold was held out}, the FEM of each fold)."""
    forces: dict[str, np.ndarray] = {}
    fitted = []
    folds = int(fold.max()) + 1
    for k in range(folds):
        progress(f"fold {k + 1} of {folds}", k / folds)
        held = np.flatnonzero(fold == k)
        found, fem = predict(np.flatnonzero(fold != k), held)
        fitted.append(fem)
        for name, own in found.items():
            forces.setdefault(name, np.zeros_like(presses.force))[presses.rows(held)] = own
    return forces, fitted


def _by_region(presses: Presses, model: Model, predict: Predict, progress: Progress) -> list[RegionResult]:
    """Each region held out as a whole."""
    made = []
    whole = regions(model, presses.point, presses.normal)
    for k, region in enumerate(whole):
        progress(f"{region.name} held out", k / len(whole))
        held = np.flatnonzero(region.members)
        forces, _ = predict(np.flatnonzero(~region.members), held)
        measured = presses.force[presses.rows(held)]
        error = {m: rms_n(f - measured) for m, f in forces.items()}
        relative = {m: e / rms_n(measured) for m, e in error.items()}
        bias = {m: float((f * measured).sum() / (measured**2).sum() - 1) for m, f in forces.items()}
        made.append(RegionResult(region, error, relative, bias))
    return made


def verdict(result: Comparison) -> str:
    """Who wins where, and by how much."""
    others = list(RIVALS)
    best = min(others, key=lambda n: result.rmse_n[n])
    ratio = result.rmse_n[best] / result.rmse_n["fem"]
    if f"{max(ratio, 1 / ratio):.1f}" == "1.0":
        words = f"FEM errs as much as {best}, the better 1D model"
    elif ratio > 1:
        words = f"FEM errs {ratio:.1f} times less than {best}, the better 1D model"
    else:
        words = f"{best} errs {1 / ratio:.1f} times less than FEM"
    wins = {n: result.wins(n) for n in others}
    lost = [r.region.name for r in result.regions if min(r.rmse_n[n] for n in others) < r.rmse_n["fem"]]
    words += f"; of {len(result.presses)} presses FEM predicts {result.wins('fem')} best"
    words += "".join(f", {n} {count}" for n, count in wins.items() if count)
    if lost:
        words += f"; a 1D model wins in {', '.join(lost)}"
    elif not any(wins.values()):
        words += "; a 1D model wins nowhere here"
    renderer = result.recording and (result.recording.truth or {}).get("renderer")
    if renderer:
        words += f"; the forces were rendered ({renderer}), not measured"
        words += ": FEM is held against itself" if renderer == "fem" else ""
    return words


@dataclass(frozen=True)
class HeldOutRegion:
    """name: as in the report. words: what it is. members: (p,) bool, the presses inside."""

    name: str
    words: str
    members: np.ndarray


def regions(model: Model, points: np.ndarray, normals: np.ndarray) -> list[HeldOutRegion]:
    """The regions of an object that hold enough presses; points, normals: (p, 3) of the presses.

    top: faces up (within 40 degrees of the support's normal). top-centre: its inner part, so that the data
    left lie towards the rim. base-band: the side's lowest 35 %. corners: where the outline reaches out by
    more than 10 % beyond the largest circle in it.
    """
    up = model.support.normal
    nodes = model.mesh.points[np.unique(model.mesh.surface[:, :3])]
    height = model.support.height(nodes)
    middle = nodes.mean(axis=0)

    def across(x: np.ndarray) -> np.ndarray:
        offset = x - middle
        return offset - (offset @ up)[:, None] * up

    h = model.support.height(points) / height.max()
    out = np.linalg.norm(across(points), axis=1)
    inscribed = _inscribed_radius(across(nodes), up)
    faces_up = normals @ up > np.cos(np.radians(40))
    top = np.flatnonzero(faces_up)
    centre = np.zeros(len(points), dtype=bool)
    if len(top):
        centre[top] = out[top] < min(0.55 * inscribed, np.quantile(out[top], 0.5) + 1e-6)
    found = [
        HeldOutRegion("top-centre", "the inner part of the top; fitted: the rest, towards the rim", centre),
        HeldOutRegion("top", "the whole top; fitted: the side", faces_up),
        HeldOutRegion(
            "base-band", "the lowest 35 % of the side; fitted: the rest above", ~faces_up & (h < 0.35)
        ),
        HeldOutRegion(
            "corners", "beyond the largest circle in the outline; fitted: the rest", out > 1.1 * inscribed
        ),
    ]
    return [r for r in found if r.members.sum() >= LEAST_HELD and (~r.members).sum() >= LEAST_SEEN]


def _inscribed_radius(flat: np.ndarray, up: np.ndarray) -> float:
    """Distance of the outline from the middle where it is nearest, m."""
    from scipy.spatial import ConvexHull

    u = np.cross(up, np.eye(3)[np.argmin(np.abs(up))])
    u /= np.linalg.norm(u)
    plane = np.column_stack([flat @ u, flat @ np.cross(up, u)])
    return float(-ConvexHull(plane).equations[:, 2].max())
