"""Pictures of an object: the surface that is felt, coloured by a value, contact points, base.

Drawn with matplotlib, in parallel projection with hidden triangles left out, so that reports need no OpenGL,
which a bare machine may lack.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from scipy.spatial import cKDTree
from scipy.spatial.distance import cdist

from palpate.mechanics.model.model import Model
from palpate.render.surface.felt_surface import felt_surface
from palpate.show.quantities import Quantity

if TYPE_CHECKING:
    from matplotlib.axes import Axes

PLAIN_COLOUR = "#ead7bf"
TOUCH_COLOUR = "#c1121f"
BASE_COLOUR = "#1d3557"


AZIMUTH_DEG, ELEVATION_DEG = 35.0, 25.0
SPREAD_M = 0.015
"""How far a press speaks for the surface around it."""


@dataclass(frozen=True)
class Colours:
    """values: (v,) one a point of the felt surface, in the quantity's own unit; limits: of the colours."""

    values: np.ndarray
    quantity: Quantity
    limits: tuple[float, float] | None = None


def level_axes(up: np.ndarray) -> np.ndarray:
    """(2, 3) unit vectors across `up`, of which azimuths are counted: from the first towards the second."""
    up = up / np.linalg.norm(up)
    aside = np.cross(up, np.eye(3)[np.argmin(np.abs(up))])
    aside /= np.linalg.norm(aside)
    return np.array([aside, np.cross(up, aside)])


def view_axes(up: np.ndarray, elevation_deg: float, azimuth_deg: float) -> np.ndarray:
    """(3, 3) rows right, upward, towards the eye, for an eye at these angles about `up`."""
    up = up / np.linalg.norm(up)
    elevation, azimuth = np.radians([elevation_deg, azimuth_deg])
    level = np.array([np.cos(azimuth), np.sin(azimuth)]) @ level_axes(up)
    eye = np.cos(elevation) * level + np.sin(elevation) * up
    right = np.cross(up, eye)
    right /= np.linalg.norm(right)
    return np.array([right, np.cross(eye, right), eye])


def spread_over(points: np.ndarray, places: np.ndarray, values: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """(n,) values of places (k, 3) m at points (n, 3) m, near ones counting most; and (n,) how well they are
    known there, from 1 beside a place to 0 where none is within some SPREAD_M."""
    weight = np.exp(-((cdist(points, places) / SPREAD_M) ** 2)) + 1e-9
    total = weight.sum(axis=1)
    return (weight @ values) / total, np.clip(2.0 * total, 0.0, 1.0)


def draw_object(
    ax: Axes,
    model: Model,
    colours: Colours | None = None,
    *,
    touches: np.ndarray | None = None,
    show_base: bool = False,
    elevation_deg: float = ELEVATION_DEG,
    azimuth_deg: float = AZIMUTH_DEG,
) -> Axes:
    """Draw what a tip meets of the object (render.surface.felt_surface) and return `ax`.

    colours: what the felt surface is coloured by, with a bar beside it. touches: (k, 3) m, points as
    dots, pale where hidden; show_base: the fixed corner nodes as dots.
    """
    from matplotlib import colormaps
    from matplotlib.cm import ScalarMappable
    from matplotlib.collections import PolyCollection
    from matplotlib.colors import Normalize, to_rgb

    mesh, surface = model.mesh, felt_surface(model)
    view = view_axes(model.support.normal, elevation_deg, azimuth_deg)
    seen = (surface.points - mesh.points.mean(axis=0)) @ view.T * 1e3
    triangles = surface.triangles[surface.touchable[surface.triangles].all(axis=1)]
    p = seen[triangles]
    front = np.cross(p[:, 1] - p[:, 0], p[:, 2] - p[:, 0])[:, 2] > 0
    normal = (surface.normals[triangles].mean(axis=1)) @ view.T
    normal /= np.maximum(np.linalg.norm(normal, axis=1, keepdims=True), 1e-300)
    order = np.flatnonzero(front)[np.argsort(p[front][:, :, 2].mean(axis=1))]
    shade = 0.55 + 0.45 * np.clip(normal @ np.array([-0.35, 0.55, 0.76]), 0, 1)
    if colours is None:
        colour = np.tile(to_rgb(PLAIN_COLOUR), (len(triangles), 1))
    else:
        at = np.asarray(colours.values, dtype=float)[triangles].mean(axis=1)
        scale = Normalize(*(colours.limits or (float(np.nanmin(at)), float(np.nanmax(at)))))
        colour = colormaps[colours.quantity.colour_map](scale(at))[:, :3]
        bar = ax.figure.colorbar(
            ScalarMappable(norm=scale, cmap=colours.quantity.colour_map),
            ax=ax, label=colours.quantity.label, shrink=0.7, fraction=0.046, pad=0.02,
        )  # fmt: skip
        bar.outline.set_visible(False)
    colour = colour * shade[:, None]
    ax.add_collection(
        PolyCollection(p[order][:, :, :2], facecolors=colour[order], edgecolors=colour[order], linewidths=0.5)
    )
    if show_base:
        corners = mesh.linear()
        base = (corners.points[corners.fixed] - mesh.points.mean(axis=0)) @ view.T * 1e3
        ax.scatter(base[:, 0], base[:, 1], s=16, color=BASE_COLOUR, label="fixed base", zorder=0.4)
    if touches is not None and len(touches):
        dots = (np.asarray(touches) - mesh.points.mean(axis=0)) @ view.T * 1e3
        visible = front[cKDTree(p.mean(axis=1)).query(dots)[1]]
        ax.scatter(dots[~visible, 0], dots[~visible, 1], s=14, color=TOUCH_COLOUR, alpha=0.25, zorder=0.5)
        ax.scatter(
            dots[visible, 0], dots[visible, 1], s=26, color=TOUCH_COLOUR, label="contact points",
            edgecolors="white", linewidths=0.6, zorder=3,
        )  # fmt: skip
    ax.set_aspect("equal")
    ax.autoscale_view()
    ax.set_axis_off()
    return ax


def draw_touched(ax: Axes, model: Model) -> None:
    """The object with the places touched and its fixed base, both named below."""
    draw_object(ax, model, touches=model.presses.point, show_base=True)
    ax.legend(loc="upper center", frameon=False, bbox_to_anchor=(0.5, 0.0), ncols=2)
