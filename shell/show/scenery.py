"""3D scenes of results by PyVista: the object on its support, what was touched, tips and forces."""

from __future__ import annotations

import os
import sys
from typing import TYPE_CHECKING, Any

import numpy as np

from palpate.mechanics.errors import OptionError
from palpate.mechanics.model.model import Model
from palpate.mechanics.shape.tetmesh import vertex_normals
from palpate.render.base import Renderer
from palpate.render.surface.felt_surface import felt_surface
from palpate.show.object3d import view_axes

if TYPE_CHECKING:
    import pyvista

OBJECT_COLOUR, SUPPORT_COLOUR, TIP_COLOUR, ARROW_COLOUR = "#ead7bf", "#d9dee5", "#d95f02", "#1b4f9c"
ARROW_M_PER_N = 0.03
_LINE_POINTS = 20_000
_BAR = {"n_labels": 2, "fmt": "%.3g", "color": "black", "title_font_size": 18, "label_font_size": 15}


def new_plotter(*, off_screen: bool) -> pyvista.Plotter:
    """A plotter of our own; raises OptionError where it would open a window and there is no screen."""
    import pyvista

    plotter = pyvista.Plotter(off_screen=off_screen or None, window_size=[1000, 750])
    screen = any(os.environ.get(name) for name in ("DISPLAY", "WAYLAND_DISPLAY"))
    if sys.platform.startswith("linux") and not (screen or plotter.off_screen or plotter.notebook):
        plotter.close()
        raise OptionError(
            "there is no screen (neither DISPLAY nor WAYLAND_DISPLAY is set): write a picture with "
            "show(screenshot='NAME.png'), or hand in a plotter that is off screen"
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
    _add_surface(plotter, model, *surface_of(model), felt_surface(model).normals, values, label, colour_map)


def add_deformed(plotter: pyvista.Plotter, renderer: Renderer, displacement: np.ndarray) -> None:
    """The renderer's surface, displaced by (n, 3) m and coloured by how far, on its support plane."""
    rest, triangles = renderer.surface
    turned = vertex_normals(rest + displacement, triangles) - vertex_normals(rest, triangles)
    normals = renderer.contact.arrays.normals + turned
    moved = 1e3 * np.linalg.norm(displacement, axis=1)
    _add_surface(
        plotter, renderer.model, rest + displacement, triangles, normals, moved, "displacement [mm]", "YlOrRd"
    )


def _add_surface(
    plotter: pyvista.Plotter,
    model: Model,
    points: np.ndarray,
    triangles: np.ndarray,
    normals: np.ndarray,
    values: np.ndarray | None,
    label: str,
    colour_map: str,
) -> None:
    import pyvista

    surface = pyvista.PolyData.from_regular_faces(np.array(points), triangles)
    # shaded as a tip feels it, not by its triangles
    surface.point_data["normals"] = normals
    surface.point_data.active_normals_name = "normals"
    look: dict[str, Any] = {"color": OBJECT_COLOUR}
    used = np.unique(triangles)
    if values is not None:
        surface[label] = np.asarray(values, dtype=float)
        limits = float(np.nanmin(surface[label][used])), float(np.nanmax(surface[label][used]))
        look = {"scalars": label, "cmap": colour_map, "clim": limits}
        look["scalar_bar_args"] = {"title": label, **_BAR}
    actor = plotter.add_mesh(surface, ambient=0.3, diffuse=0.75, **look)
    actor.prop.interpolation = "Gouraud"
    size = 1.5 * float(np.linalg.norm(np.ptp(points[used], axis=0)))
    middle, up = points[used].mean(axis=0), model.support.normal
    foot = middle - model.support.height(middle) * up
    plane = pyvista.Plane(center=foot, direction=up, i_size=size, j_size=size)
    plotter.add_mesh(plane, color=SUPPORT_COLOUR, lighting=False)
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
    colour: str = "#c1121f",
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
    look: dict[str, Any] = {"color": "#8a96a5"}
    if values is not None:
        line[label] = np.asarray(values, dtype=float)[kept]
        look = {"scalars": label, "cmap": "viridis", "scalar_bar_args": {"title": label, **_BAR}}
    plotter.add_mesh(line, line_width=3, lighting=False, **look)


def add_tip(plotter: pyvista.Plotter, centre: np.ndarray, radius_m: float) -> None:
    """The tool's tip, a ball with its centre (3,) m."""
    import pyvista

    plotter.add_mesh(pyvista.Sphere(radius=radius_m, center=centre), color=TIP_COLOUR, specular=0.4)


def add_arrow(plotter: pyvista.Plotter, start: np.ndarray, along: np.ndarray, length_m: float) -> None:
    """An arrow from `start` (3,) m along a vector (3,)."""
    import pyvista

    plotter.add_mesh(pyvista.Arrow(start=start, direction=along, scale=length_m), color=ARROW_COLOUR)


def add_force(plotter: pyvista.Plotter, start: np.ndarray, force_n: np.ndarray) -> None:
    """A force (3,) N on the tool as an arrow of 30 mm a newton."""
    size = float(np.linalg.norm(force_n))
    if size > 0:
        add_arrow(plotter, start, force_n, ARROW_M_PER_N * size)


def look_around(plotter: pyvista.Plotter, up: np.ndarray, points: np.ndarray) -> None:
    """Aim the camera at points (n, 3) m where there is no object to aim at."""
    _look_from(plotter, points.mean(axis=0), up, float(np.linalg.norm(np.ptp(points, axis=0))))
