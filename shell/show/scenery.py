"""Pictures of an object: the surface that is felt, coloured by a value, contact points, base.

Drawn with matplotlib, in parallel projection with hidden triangles left out, so that reports need no OpenGL,
which a bare machine may lack.

3D scenes of results by PyVista: the object on its support, what was touched, tips and forces.
"""

from __future__ import annotations

import ctypes
import os
import sys
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from scipy.spatial import cKDTree
from scipy.spatial.distance import cdist

from palpate.mechanics.errors import OptionError
from palpate.mechanics.model.model import Model
from palpate.render.base import Renderer
from palpate.render.surface.felt_surface import felt_surface
from palpate.show.colours import COLOURS
from palpate.show.light import LitSurface, lit
from palpate.show.quantities import ShownQuantity

if TYPE_CHECKING:
    import pyvista
    from matplotlib.axes import Axes

AZIMUTH_DEG, ELEVATION_DEG = 35.0, 25.0
SPREAD_M = 0.015
"""How far a press speaks for the surface around it."""


@dataclass(frozen=True)
class Colours:
    """values: (v,) one a point of the felt surface, in the quantity's own unit; limits: of the colours."""

    values: np.ndarray
    quantity: ShownQuantity
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
        colour = np.tile(to_rgb(COLOURS["object"]), (len(triangles), 1))
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
        ax.scatter(base[:, 0], base[:, 1], s=16, color=COLOURS["base"], label="fixed base", zorder=0.4)
    if touches is not None and len(touches):
        dots = (np.asarray(touches) - mesh.points.mean(axis=0)) @ view.T * 1e3
        visible = front[cKDTree(p.mean(axis=1)).query(dots)[1]]
        ax.scatter(dots[~visible, 0], dots[~visible, 1], s=14, color=COLOURS["touch"], alpha=0.25, zorder=0.5)
        ax.scatter(
            dots[visible, 0], dots[visible, 1], s=26, color=COLOURS["touch"], label="contact points",
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


ARROW_M_PER_N = 0.03
_LINE_POINTS = 20_000
_BAR = {"n_labels": 2, "fmt": "%.3g", "color": "black", "title_font_size": 18, "label_font_size": 15}


def no_screen() -> str:
    """Why a window would have nowhere to open; '' where it has. Drawing where no X server answers ends the
    program without a word."""
    if not sys.platform.startswith("linux") or os.environ.get("WAYLAND_DISPLAY"):
        return ""
    display = os.environ.get("DISPLAY")
    if not display:
        return "there is no screen (neither DISPLAY nor WAYLAND_DISPLAY is set)"
    try:
        x11 = ctypes.CDLL("libX11.so.6")
    except OSError:
        return ""  # nobody to ask
    x11.XOpenDisplay.restype = ctypes.c_void_p
    answers = x11.XOpenDisplay(None)
    if not answers:
        return f"there is no screen (none answers at DISPLAY={display})"
    x11.XCloseDisplay(ctypes.c_void_p(answers))
    return ""


def new_plotter(*, off_screen: bool) -> pyvista.Plotter:
    """A plotter of our own; raises OptionError where it would open a window and there is no screen."""
    import pyvista

    plotter = pyvista.Plotter(off_screen=off_screen or None, window_size=[1000, 750])
    why = "" if plotter.off_screen or plotter.notebook else no_screen()
    if why:
        plotter.close()
        raise OptionError(
            f"{why}: write a picture with show(screenshot='NAME.png'), or hand in a plotter that is off "
            "screen"
        )
    plotter.background_color = pyvista.Color("white")
    return plotter


def surface_of(model: Model) -> tuple[np.ndarray, np.ndarray]:
    """Points (n, 3) m and outward triangles (k, 3) of what a tip meets, the base left out."""
    surface = felt_surface(model)
    return surface.points, surface.triangles[surface.touchable[surface.triangles].all(axis=1)]


def add_object(
    plotter: pyvista.Plotter,
    model: Model,
    values: np.ndarray | None = None,
    *,
    label: str = "",
    colour_map: str = "viridis",
) -> None:
    """The touchable surface on its support plane. values (n,): one a point of `surface_of`, named `label`."""
    points, triangles = surface_of(model)
    _add_surface(plotter, model, points, lit(points, triangles), values, label, colour_map)


def add_deformed(plotter: pyvista.Plotter, renderer: Renderer, displacement: np.ndarray) -> None:
    """The renderer's surface, displaced by (n, 3) m and coloured by how far, on its support plane."""
    (rest, triangles), moved = renderer.surface, 1e3 * np.linalg.norm(displacement, axis=1)
    seen = lit(rest, triangles, renderer.contact.arrays.free > 0)
    _add_surface(plotter, renderer.model, rest + displacement, seen, moved, "displacement [mm]", "YlOrRd")


def _add_surface(
    plotter: pyvista.Plotter,
    model: Model,
    points: np.ndarray,
    seen: LitSurface,
    values: np.ndarray | None,
    label: str,
    colour_map: str,
) -> None:
    import pyvista

    drawn = points[seen.at]
    surface = pyvista.PolyData.from_regular_faces(drawn, seen.triangles)
    surface.point_data["normals"] = seen.turned(points)
    surface.point_data.active_normals_name = "normals"
    look: dict[str, Any] = {"color": COLOURS["object"]}
    if values is not None:
        surface[label] = np.asarray(values, dtype=float)[seen.at]
        limits = float(np.nanmin(surface[label])), float(np.nanmax(surface[label]))
        look = {"scalars": label, "cmap": colour_map, "clim": limits}
        look["scalar_bar_args"] = {"title": label, **_BAR}
    actor = plotter.add_mesh(surface, ambient=0.3, diffuse=0.75, **look)
    actor.prop.interpolation = "Gouraud"
    size = 1.5 * float(np.linalg.norm(np.ptp(drawn, axis=0)))
    middle, up = drawn.mean(axis=0), model.support.normal
    foot = middle - model.support.height(middle) * up
    plane = pyvista.Plane(center=foot, direction=up, i_size=size, j_size=size)
    plotter.add_mesh(plane, color=COLOURS["support"], lighting=False)
    _look_from(plotter, middle, up, size)


def _look_from(plotter: pyvista.Plotter, middle: np.ndarray, up: np.ndarray, size: float) -> None:
    eye = view_axes(up, 25.0, 35.0)[2]
    plotter.camera_position = [middle + 1.6 * size * eye, middle, up]
    plotter.camera.view_angle = 25.0


def add_dots(
    plotter: pyvista.Plotter,
    points: np.ndarray,
    values: np.ndarray | None = None,
    *,
    label: str = "",
    limits: tuple[float, float] | None = None,
    colour: str = COLOURS["touch"],
    colour_map: str = "viridis",
) -> None:
    """Small balls at points (k, 3) m, in one colour or by values (k,) named `label`; limits: of the
    colours."""
    import pyvista

    if not len(points):
        return
    cloud = pyvista.PolyData(np.asarray(points, dtype=float))
    look: dict[str, Any] = {"color": colour}
    if values is not None:
        cloud[label] = np.asarray(values, dtype=float)
        look = {"scalars": label, "cmap": colour_map, "scalar_bar_args": {"title": label, **_BAR}}
        look["clim"] = limits
    ball = pyvista.Sphere(radius=2e-3, theta_resolution=16, phi_resolution=16)
    balls: Any = cloud.glyph(geom=ball, scale=False, orient=False)
    plotter.add_mesh(balls, **look)


def add_path(
    plotter: pyvista.Plotter, points: np.ndarray, values: np.ndarray | None = None, label: str = ""
) -> None:
    """A line through points (n, 3) m, grey or coloured by values (n,) named `label`; thinned where long."""
    import pyvista

    kept = slice(None, None, max(1, len(points) // _LINE_POINTS))
    line = pyvista.lines_from_points(np.asarray(points, dtype=float)[kept])
    look: dict[str, Any] = {"color": COLOURS["path"]}
    if values is not None:
        line[label] = np.asarray(values, dtype=float)[kept]
        look = {"scalars": label, "cmap": "viridis", "scalar_bar_args": {"title": label, **_BAR}}
    plotter.add_mesh(line, line_width=3, lighting=False, **look)


def add_tip(plotter: pyvista.Plotter, centre: np.ndarray, radius_m: float) -> None:
    """The tool's tip, a ball with its centre (3,) m."""
    import pyvista

    plotter.add_mesh(pyvista.Sphere(radius=radius_m, center=centre), color=COLOURS["tip"], specular=0.4)


def add_arrow(
    plotter: pyvista.Plotter,
    start: np.ndarray,
    along: np.ndarray,
    length_m: float,
    colour: str = COLOURS["next-touch"],
) -> None:
    """An arrow from `start` (3,) m along a vector (3,)."""
    import pyvista

    plotter.add_mesh(pyvista.Arrow(start=start, direction=along, scale=length_m), color=colour)


def add_force(plotter: pyvista.Plotter, start: np.ndarray, force_n: np.ndarray) -> None:
    """A force (3,) N on the tool as an arrow of 30 mm a newton."""
    size = float(np.linalg.norm(force_n))
    if size > 0:
        add_arrow(plotter, start, force_n, ARROW_M_PER_N * size, COLOURS["fem"])


def look_around(plotter: pyvista.Plotter, up: np.ndarray, points: np.ndarray) -> None:
    """Aim the camera at points (n, 3) m where there is no object to aim at."""
    _look_from(plotter, points.mean(axis=0), up, float(np.linalg.norm(np.ptp(points, axis=0))))
