"""Figures 4, 5 and 6 of the paper, remade: parameters of single presses and where on the object they hold."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from scipy.interpolate import RBFInterpolator
from scipy.stats import pearsonr, spearmanr

from palpate.mechanics.model.model import Model
from palpate.reconstruction.pipeline import Reconstruction
from palpate.reconstruction.steps.s7_modulus.modulus import ModulusFit
from palpate.render.surface.felt_surface import felt_surface
from palpate.show.colours import COLOURS
from palpate.show.page import subplots
from palpate.show.quantities import KELVIN_VOIGT, MODULUS, ShownQuantity
from palpate.show.reconstruction.exploration import spread
from palpate.show.scenery import Colours, draw_object

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

_FLAT = 0.01
"""Of the greatest spread of the places: less is no direction that a slope is read along."""
SIDE = 0.3  # |n . support normal| below this: a press on the side


@dataclass(frozen=True)
class Trend:
    """Correlation of a parameter with height over the presses on the side.

    change: of a straight line over the range of heights, as a share of the mean.
    """

    name: str
    pearson: float
    pearson_p: float
    spearman: float
    spearman_p: float
    presses: int
    change: float


def heights(model: Model) -> np.ndarray:
    """(k,) m, heights of the contacts above the support."""
    return model.support.height(model.presses.point)


def on_side(model: Model) -> np.ndarray:
    """(k,) bool, presses whose normal is within 17 degrees of the support plane."""
    return np.abs(model.presses.normal @ model.support.normal) < SIDE


def height_trends(model: Model) -> list[Trend]:
    """Correlations of k_v, k_h and e with height on the side; empty with fewer than 5 presses there."""
    side, height = on_side(model), heights(model)
    trends = []
    for name in ("k_v", "k_h", "e_pa"):
        values = model.presses.fits[name]
        used = side & np.isfinite(values)
        if used.sum() >= 5:
            r, p = pearsonr(height[used], values[used])
            s, q = spearmanr(height[used], values[used])
            slope = np.polyfit(height[used], values[used], 1)[0]
            change = float(slope * np.ptp(height[used]) / values[used].mean())
            trends.append(Trend(name, float(r), float(p), float(s), float(q), int(used.sum()), change))
    return trends


def over_surface(model: Model, values: np.ndarray) -> np.ndarray:
    """(v,) values of single presses spread over the felt surface by radial basis functions (thin plate,
    smoothed).

    Repeats at one place are averaged by the smoothing; the result is kept within the range of the values.
    """
    points = model.presses.point
    used = np.isfinite(values)
    scale = np.linalg.norm(np.ptp(points, axis=0))
    centre, size = np.median(values[used]), max(float(np.std(values[used])), 1e-12)
    at, axes = points[used], _spread_axes(points[used])
    felt = felt_surface(model).points
    if not len(axes):
        return np.full(len(felt), centre)
    smooth = RBFInterpolator(at @ axes.T / scale, (values[used] - centre) / size, smoothing=1e-2)
    field = centre + size * smooth(felt @ axes.T / scale)
    return np.clip(field, values[used].min(), values[used].max())


def _spread_axes(points: np.ndarray) -> np.ndarray:
    """(k, 3) the directions along which points (n, 3) lie apart: two for places in one plane, one on a line;
    only those that n places can tell a slope along."""
    centred = points - points.mean(axis=0)
    _, spread, axes = np.linalg.svd(centred, full_matrices=False)
    kept = axes[spread > _FLAT * max(float(spread[0]), 1e-300)] if spread[0] > 0 else axes[:0]
    return kept[: len(np.unique(points, axis=0)) - 1]


def undamped_figure(models: dict[str, Model]) -> Figure:
    """Figure 4: k_V; k_C and r; k_H, one box a sample."""
    figure, axes = subplots(1, 4, figsize=(13, 3.4))
    labels = ("$k_V$ [N/m]", "$k_C$ [N/m$^r$]", "$r$", "$k_H$ [N/m$^r$]")
    for ax, name, label, letter in zip(axes, ("k_v", "k_c", "r_c", "k_h"), labels, "abcd", strict=True):
        spread(ax, [m.presses.fits[name] for m in models.values()], list(models))
        ax.set_ylabel(label)
        ax.set_title(f"({letter})", loc="left", fontsize=10)
        ax.tick_params(axis="x", labelrotation=20, labelsize=8, labelbottom=len(models) > 1)
    return figure


def spatial_figure(model: Model, name: str = "", other: tuple[str, Model] | None = None) -> Figure:
    """Figure 5: k_V over the surface from the side and from above, and of another sample (else this) aslant,
    all on one scale; k_V, k_H and e over height on the side, each over its mean and on one scale."""
    figure, axes = subplots(2, 3, figsize=(13, 7.2))
    aslant = (*(other or (name, model)), 30.0, "aslant")
    views = [(name, model, 8.0, "side"), (name, model, 89.0, "top"), aslant]
    limits = _limits([m for _, m, _, _ in views], "k_v", KELVIN_VOIGT)
    for ax, (called, shown, elevation, view) in zip(axes[0], views, strict=True):
        _coloured(ax, shown, "k_v", KELVIN_VOIGT, limits, elevation)
        ax.set_title(f"{called if other else ''} {view}".strip(), fontsize=10)
    trends = {t.name: t for t in height_trends(model)}
    side, height = on_side(model), heights(model) * 1e3
    reach = 0.1
    for ax, key, label in zip(axes[1], ("k_v", "k_h", "e_pa"), ("$k_V$", "$k_H$", "e"), strict=True):
        value = model.presses.fits[key]
        share = 100 * (value[side] / np.nanmean(value[side]) - 1) if side.any() else np.zeros(0)
        ax.plot(height[side], share, "o", ms=4, color=COLOURS["press"])
        ax.axhline(0, color=COLOURS["whole"], lw=1)
        ax.set(xlabel="height above the support [mm]", ylabel=f"{label} over its mean [%]")
        reach = max([reach, *np.abs(share[np.isfinite(share)])])
        if key in trends:
            ax.set_title(f"correlation {trends[key].pearson:+.2f}", fontsize=10)
    for ax in axes[1]:
        ax.set_ylim(-1.15 * reach, 1.15 * reach)
    return figure


def _limits(models: list[Model], key: str, quantity: ShownQuantity) -> tuple[float, float]:
    """Of the colours of one column of several models: without the outermost twentieth of the presses."""
    values = np.concatenate([m.presses.fits[key] for m in models]) * quantity.scale
    low, high = np.nanpercentile(values, [5, 95])
    return quantity.limits(float(low), float(max(high, low + 1e-9)))


def _coloured(
    ax: Axes,
    model: Model,
    key: str,
    quantity: ShownQuantity,
    limits: tuple[float, float],
    elevation_deg: float = 25.0,
) -> None:
    """The object coloured by a column of its palpations."""
    values = model.presses.fits[key] * quantity.scale
    colours = Colours(over_surface(model, values), quantity, limits)
    touches = model.presses.point[np.isfinite(values)]
    draw_object(ax, model, colours, touches=touches, elevation_deg=elevation_deg)


def moduli_figure(models: dict[str, Model]) -> Figure:
    """Figure 6: (a) moduli of single presses, * the global one with its interval; (b) where they hold, on two
    samples, on one scale."""
    shown = list(models.items())[:2]
    figure, axes = subplots(1, 1 + len(shown), figsize=(5 + 4.5 * len(shown), 4.4))
    stars = [m.material.young_modulus_pa / 1e3 for m in models.values()]
    spread(axes[0], [m.presses.fits["e_pa"] / 1e3 for m in models.values()], list(models), stars)
    for i, model in enumerate(models.values()):
        low, high = np.array(model.material.young_modulus_ci95_pa) / 1e3
        if np.isfinite([low, high]).all():
            axes[0].plot(
                [i + 1.34] * 2, [low, high], "-", lw=3, color=COLOURS["whole"], solid_capstyle="butt"
            )
        axes[0].annotate(
            f"{stars[i]:.2f}", (i + 1.34, stars[i]), xytext=(6, 0), textcoords="offset points", va="center"
        )
    axes[0].set(ylabel="Young's modulus [kPa]", xlim=(0.5, len(models) + 0.9))
    axes[0].margins(y=0.12)
    axes[0].tick_params(axis="x", labelrotation=15, labelbottom=len(models) > 1)
    axes[0].set_title("(a)", loc="left", fontsize=10)
    limits = _limits([m for _, m in shown], "e_pa", MODULUS)
    for ax, (name, model) in zip(axes[1:], shown, strict=True):
        _coloured(ax, model, "e_pa", MODULUS, limits)
        ax.set_title(f"(b) {name}" if len(shown) > 1 else "(b)", loc="left", fontsize=10)
    return figure


def depth_figure(fit: ModulusFit) -> Figure:
    """The global modulus over the greatest depth of the samples used, with the interval of the one chosen."""
    figure, ax = subplots(1, 1, figsize=(6, 3.2))
    depth = np.array([row[0] for row in fit.by_depth]) * 1e3
    value = np.array([row[1] for row in fit.by_depth]) / 1e3
    agrees = np.array([row[2] for row in fit.by_depth])
    ax.axhspan(*(np.array(fit.ci95_pa) / 1e3), color=COLOURS["interval"], label="95 % sure")
    ax.plot(depth, value, "-", lw=1, color=COLOURS["press"])
    ax.plot(depth[agrees], value[agrees], "o", color=COLOURS["press"], label="agrees with shallower samples")
    if (~agrees).any():
        ax.plot(depth[~agrees], value[~agrees], "o", mfc="white", color=COLOURS["press"], label="does not")
    ax.plot(fit.press.depth_m * 1e3, fit.modulus_pa / 1e3, "*", ms=13, color=COLOURS["whole"], label="chosen")
    low, high = min(value.min(), fit.ci95_pa[0] / 1e3), max(value.max(), fit.ci95_pa[1] / 1e3)
    margin = 0.3 * (high - low)
    ax.set(xlabel="samples up to depth [mm]", ylabel="modulus [kPa]", ylim=(low - margin, high + 2 * margin))
    ax.legend(frameon=False, fontsize=8, ncols=2)
    return figure


def quality_histogram(ax: Axes, values: np.ndarray, label: str, bound: float, word: str = "bound") -> Axes:
    """Histogram of a mesh quality, its bound drawn where it lies among the values, else named."""
    ax.hist(values, bins=40, color=COLOURS["press"])
    most = float(values.max())
    ax.set(xlabel=label, ylabel="count")
    if bound > 1.3 * most:
        ax.set_xlim(min(0.0, float(values.min())), 1.05 * most)
        ax.plot([], [], " ", label=f"all lie below the {word}, {bound:g}")
    else:
        ax.axvline(bound, color=COLOURS["whole"], lw=1.5, label=f"{word} {bound:g}")
    ax.legend(frameon=False, fontsize=8, loc="lower left", bbox_to_anchor=(0.0, 1.0), ncols=2)
    return ax


def mesh_figure(result: Reconstruction) -> Figure:
    """Qualities of the mesh."""
    report = result.meshing.report
    figure, axes = subplots(1, 3, figsize=(12, 2.8))
    quality_histogram(axes[0], report.radius_edge_ratio, "radius-edge ratio", 2.0)
    wanted = result.model.mesh_size_m * 1e3
    quality_histogram(axes[1], report.edge_m * 1e3, "edge length [mm]", wanted, "wanted")
    quality_histogram(axes[2], report.surface_distance_m * 1e3, "distance to the surface [mm]", 2.0)
    return figure
