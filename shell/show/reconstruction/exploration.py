"""Figures 2 and 3 of the paper, remade: contacts over time, geometry, force profiles, 1D parameters."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from scipy.spatial import cKDTree

from palpate.mechanics.model.model import Model
from palpate.reconstruction.measured import Measured
from palpate.reconstruction.pipeline import Reconstruction
from palpate.reconstruction.steps.s6_one_d import profiles
from palpate.reconstruction.steps.s7_modulus.modulus_paper import nearest_nodes
from palpate.render.surface.felt_surface import felt_surface
from palpate.show.colours import COLOURS
from palpate.show.page import subplots
from palpate.show.scenery import draw_object, view_axes

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure


def force_over_time(ax: Axes, exploration: Measured) -> Axes:
    """Figure 2: force magnitude (N) over time (s), first touches (o), peaks (+), phase I shaded."""
    t = exploration.recording.t
    force = np.linalg.norm(exploration.force, axis=1)
    starts, peaks = (
        np.searchsorted(t, at) for at in (exploration.presses.onset_s, exploration.presses.peak_s)
    )
    ax.plot(t, force, lw=0.7, color=COLOURS["measured"])
    ax.plot(t[starts], force[starts], "o", ms=4, mfc="none", color=COLOURS["touch"], label="first touch")
    ax.plot(t[peaks], force[peaks], "+", ms=7, color=COLOURS["peak"], label="peak")
    first, last = exploration.boundary.interval
    if last > first:
        ax.axvspan(t[first], t[last - 1], color=COLOURS["base-tracing"], zorder=0, label="tracing the foot")
    ax.set(xlabel="time [s]", ylabel="force magnitude [N]", xlim=(t[0], t[-1]))
    ax.legend(loc="lower right", bbox_to_anchor=(1.0, 1.0), frameon=False, ncols=3)
    return ax


def touched_points(ax: Axes, exploration: Measured) -> Axes:
    """Figure 3(a): first touches (+), base outline, its farthest-point sample (o); parallel projection,
    mm."""
    boundary = exploration.boundary
    view = view_axes(boundary.support_normal, 22.0, 35.0)

    def seen(points: np.ndarray) -> np.ndarray:
        return (points - boundary.support_point) @ view.T * 1e3

    rim, sample, touches = seen(boundary.outline), seen(boundary.points), seen(exploration.presses.point)
    ax.plot(rim[:, 0], rim[:, 1], lw=1, color=COLOURS["base"], label="base outline")
    ax.plot(
        sample[:, 0], sample[:, 1], "o", ms=4, mfc="none", color=COLOURS["base"], label="sample of the base"
    )
    ax.plot(touches[:, 0], touches[:, 1], "+", ms=8, color=COLOURS["touch"], label="first touches")
    ax.set_aspect("equal")
    ax.set_axis_off()
    ax.legend(loc="upper center", bbox_to_anchor=(0.5, 0.04), frameon=False, ncols=3, fontsize=8)
    return ax


def meshed_object(ax: Axes, result: Reconstruction) -> Axes:
    """Figure 3(b): the felt surface with the mesh's edges laid onto it, fixed base nodes, and the node
    nearest to each contact, with the number of its first press."""
    model = result.model
    draw_object(ax, model, show_base=True, elevation_deg=22.0)
    view = view_axes(model.support.normal, 22.0, 35.0)
    _mesh_edges(ax, model, view)
    corners = model.mesh.linear()
    node = nearest_nodes(corners, result.exploration.presses.point)
    seen = (corners.points[node] - model.mesh.points.mean(axis=0)) @ view.T * 1e3
    facing = model.presses.normal @ view[2] > 0
    first = np.unique(node, return_index=True)[1]
    for i in first[facing[first]]:
        x, y = seen[i, :2]
        ax.plot(x, y, "o", ms=9, mfc="white", mec=COLOURS["touch"], mew=1)
        ax.text(x, y, str(i + 1), ha="center", va="center", fontsize=5.5)
    return ax


def _mesh_edges(ax: Axes, model: Model, view: np.ndarray, pieces: int = 5) -> None:
    """The edges of the mesh's touchable surface, where the felt surface has them and faces the eye."""
    from matplotlib.collections import LineCollection

    surface = felt_surface(model)
    triangles = model.mesh.touchable_surface[:, :3]
    edges = np.unique(np.sort(np.vstack([np.roll(triangles, k, axis=1)[:, :2] for k in range(3)])), axis=0)
    share = np.linspace(0.0, 1.0, pieces)[:, None]
    ends = model.mesh.points[edges][:, :, None]
    own = np.flatnonzero(surface.touchable)
    near = own[cKDTree(surface.points[own]).query(ends[:, 0] * (1 - share) + ends[:, 1] * share)[1]]
    facing = (surface.normals[near] @ view[2] > 0.02).all(axis=1)
    seen = (surface.points[near[facing]] - model.mesh.points.mean(axis=0)) @ view[:2].T * 1e3
    ax.add_collection(LineCollection(seen, colors=COLOURS["mesh"], linewidths=0.4))


def force_profiles(ax: Axes, result: Reconstruction) -> Axes:
    """Figure 3(c): force on the object along -n (N) over depth (mm), coloured by height above the support."""
    from matplotlib import colormaps
    from matplotlib.cm import ScalarMappable
    from matplotlib.colors import Normalize

    exploration = result.exploration
    height = exploration.boundary.height(result.cast.points)
    curves = profiles(result.model.presses)
    scale = Normalize(0, 1e3 * height.max())
    for i, h in enumerate(height):
        rows = curves.rows([i])
        rows = rows[curves.depth[rows] > 0]
        ax.plot(
            curves.depth[rows] * 1e3, curves.push[rows], lw=0.8, color=colormaps["viridis"](scale(1e3 * h))
        )
    bar = ax.figure.colorbar(ScalarMappable(scale, "viridis"), ax=ax, label="height [mm]")
    bar.outline.set_visible(False)
    ax.set(xlabel="depth [mm]", ylabel="force [N]", xlim=(0, None), ylim=(0, None))
    return ax


def damped_parameters(axes: np.ndarray, result: Reconstruction) -> np.ndarray:
    """Figure 3(d): distributions of the Kelvin-Voigt and Hunt-Crossley parameters."""
    columns = [
        ("k_kv", "$k_{KV}$ [N/m]"),
        ("b_kv", "$b_{KV}$ [N s/m]"),
        ("k_hc", "$k_{HC}$ [N/m$^r$]"),
        ("b_hc", "$b_{HC}$ [N s/m$^{r+1}$]"),
        ("r_hc", "$r$"),
    ]
    for ax, (name, label) in zip(axes, columns, strict=True):
        spread(ax, [result.model.presses.fits[name]], [""])
        ax.set_title(label, fontsize=10)
    return axes


def spread(ax: Axes, samples: list[np.ndarray], names: list[str], stars: list[float] | None = None) -> Axes:
    """A box and every value of each sample; stars: one marked value a sample."""
    samples = [s[np.isfinite(s)] for s in samples]
    ax.boxplot(samples, widths=0.5, showfliers=False, medianprops={"color": COLOURS["whole"]})
    for i, sample in enumerate(samples):
        aside = np.linspace(-0.14, 0.14, len(sample))
        ax.plot(i + 1 + aside, sample, ".", ms=4, color=COLOURS["press"], alpha=0.7)
    for i, star in enumerate(stars or []):
        ax.plot(i + 1, star, "*", ms=13, color=COLOURS["whole"])
    ax.set_xticks(range(1, len(samples) + 1), names)
    return ax


def touches_figure(result: Reconstruction) -> Figure:
    """Figure 2."""
    figure, ax = subplots(1, 1, figsize=(10, 3.2), layout=None)
    force_over_time(ax, result.exploration)
    return figure


def geometry_figure(result: Reconstruction) -> Figure:
    """Figure 3 (a) to (c)."""
    figure, axes = subplots(1, 3, figsize=(13.5, 4), layout=None)
    touched_points(axes[0], result.exploration)
    meshed_object(axes[1], result)
    force_profiles(axes[2], result)
    for ax, name in zip(axes, "abc", strict=True):
        ax.set_title(f"({name})", loc="left", fontsize=10)
    return figure


def damped_figure(result: Reconstruction) -> Figure:
    """Figure 3(d)."""
    figure, axes = subplots(1, 5, figsize=(13.5, 2.8))
    damped_parameters(axes, result)
    return figure
