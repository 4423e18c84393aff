"""One renderer's object on a plotter: the surface deforming under the tip, the force as an arrow."""

from __future__ import annotations

from typing import Any

import numpy as np
import pyvista

from palpate.mechanics.frames import tangents
from palpate.mechanics.model.model import Model
from palpate.render.base import Renderer
from palpate.render.press import BESIDE
from palpate.render.support import support_plane
from palpate.scenes.phantoms import Region
from palpate.show.colours import COLOURS, INK, colour_of
from palpate.show.light import lit
from palpate.window import shadow
from palpate.window.lettering import set_type
from palpate.window.pointer import Target
from palpate.window.worker import Frame, RendererView
from palpate.words import mm

ARROW_M_PER_N = 0.03
LONGEST_ARROW = 0.25
"""Of the object's diagonal: a longer one leaves the picture, and crosses what is written there."""
LEAST_ARROW_N = 0.02
SHADOW_IN_RADII, SHADOW_OFF_M, SHADOW_FADES_M = 1.4, 0.0006, 0.06
DISPLACEMENT_RANGE_MM = (0.0, 6.0)
BAR = 11
"""Size of the colour bar's type, in a window of full size."""

LIGHT = np.array([-0.4, 0.75, 0.53])
"""Where light comes from, beside, over and before the eye, with which it turns."""
SKIN: dict[str, Any] = {"ambient": 0.8, "diffuse": 0.26}
"""How the object takes light: as matt, and its sides as light, as on a page that is pressed."""

FAR = [COLOURS["object"], COLOURS["fem"], COLOURS["displaced"]]
"""Of displacement: where nothing moves the object has its own colour."""


def add_lights(plotter: pyvista.Plotter) -> None:
    """Light the active subplot, which has no light of its own, as all objects are lit.

    A light ends where a surface turns away from it, and the eye sees a band there. So its opposite takes away
    as much on the far side: brightness goes evenly with the normal, all around."""
    for strength in (1.0, -1.0):
        light = pyvista.Light(position=strength * LIGHT, light_type="camera light", intensity=strength)
        if strength < 0:
            light.specular_color = "black"
        plotter.add_light(light, only_active=True)


class ObjectPicture:
    """Draws onto the subplot `place`; `update` moves what is there, nothing is added again."""

    def __init__(
        self,
        plotter: pyvista.Plotter,
        renderer: Renderer,
        model: Model,
        tip_radius_m: float,
        *,
        place: tuple[int, int] = (0, 0),
    ) -> None:
        self._plotter = plotter
        self._radius = tip_radius_m
        self._place = place
        plotter.subplot(*place)
        felt = renderer.contact.arrays
        self._lit = lit(felt.vertices, felt.triangles, felt.free > 0)
        self._surface = pyvista.PolyData.from_regular_faces(felt.vertices[self._lit.at], self._lit.triangles)
        self._surface["displacement (mm)"] = np.zeros(len(self._lit.at))
        self._rest, self._moved = felt.vertices, np.zeros_like(felt.vertices)
        self._longest_m = LONGEST_ARROW * float(np.linalg.norm(np.ptp(felt.vertices, axis=0)))
        self._place_surface()
        self._actor: pyvista.Actor | None = None
        self._barred = place == (0, 0)  # another picture beside it has the same colours
        self._bar, self._scale = "", 1.0
        _add_support(plotter, model, self._rest)
        self._tip = plotter.add_mesh(
            pyvista.Sphere(radius=tip_radius_m, theta_resolution=24, phi_resolution=24),
            smooth_shading=True,
            color=COLOURS["tip"],
            ambient=0.75,
            diffuse=0.5,
            specular=0.4,
        )
        self._arrow = plotter.add_mesh(
            pyvista.Arrow(tip_length=0.3, shaft_radius=0.03, tip_radius=0.08),
            ambient=0.95,
            diffuse=0.2,
        )
        self._ball = plotter.add_mesh(
            pyvista.Sphere(radius=1.0, theta_resolution=20, phi_resolution=20),
            smooth_shading=True,
            color=COLOURS["inclusion"],
            **SKIN,
        )
        self._ball.SetVisibility(False)
        self._inside: Region | None = None
        self._arrow.SetVisibility(False)
        blot = shadow.blot(SHADOW_IN_RADII * tip_radius_m)
        self._shadow = plotter.add_mesh(
            blot, scalars="shade", rgba=True, lighting=False, show_scalar_bar=False
        )
        self._shadow.SetVisibility(False)
        self.colour_by_displacement()

    def is_of(self, name: str) -> None:
        """Whose force the arrow is: it has that renderer's colour."""
        self._arrow.prop.color = colour_of(name)

    def colour_by_displacement(self) -> None:
        """As far as each point has moved, mm."""
        self.by_stiffness = False
        self._colour_by("displacement (mm)", _ramp(FAR), DISPLACEMENT_RANGE_MM)

    def colour_by_stiffness(
        self, stiffness_n_per_m: np.ndarray, limits: tuple[float, float], depth_m: float
    ) -> None:
        """(n,) N/m a point, 0 where it cannot be pressed: the secant of a press of depth_m; limits: of the
        colours."""
        self.by_stiffness = True
        name = f"force over depth at {mm(depth_m, 'g')} (N/m)"
        self._surface[name] = stiffness_n_per_m[self._lit.at]
        self._colour_by(name, "viridis", limits)

    def _colour_by(self, name: str, colours: Any, limits: tuple[float, float]) -> None:
        self._plotter.subplot(*self._place)
        opacity = 1.0
        if self._actor is not None:
            opacity = self._actor.prop.opacity
            self._plotter.remove_actor(self._actor, render=False)
            if self._barred:
                self._plotter.scalar_bars.remove_scalar_bar(self._bar, render=False)
        self._bar = name
        self._actor = self._plotter.add_mesh(
            self._surface,
            scalars=name,
            cmap=colours,
            clim=limits,
            opacity=opacity,
            culling="back",  # the foot, where it is seen edge on, would sparkle; seen through, it would shine
            **SKIN,
            show_scalar_bar=self._barred,
            scalar_bar_args={
                "title": name,
                "n_labels": 2,  # a third would lie under the title
                "fmt": "%.0f",
                "width": 0.42,
                "height": 0.06,
                "position_x": 0.56,
                "position_y": 0.02,
                "unconstrained_font_size": True,
            },
            render=False,
        )
        for words in self._bar_letters():
            set_type(words, round(BAR * self._scale), False, INK)
        self._actor.prop.interpolation = "Gouraud"

    def scale(self, scale: float) -> None:
        """The bar's letters as large as the window is, against one of full size."""
        self._scale = scale
        for words in self._bar_letters():
            words.SetFontSize(round(BAR * scale))

    def _bar_letters(self) -> list[Any]:
        if not self._barred:
            return []
        bar = self._plotter.scalar_bars[self._bar]
        return [bar.GetTitleTextProperty(), bar.GetLabelTextProperty()]

    def _place_surface(self) -> None:
        """Where it has moved to, and lit as it has turned."""
        points = self._rest + self._moved
        self._surface.points = points[self._lit.at]
        self._surface.point_data["normals"] = self._lit.turned(points)
        self._surface.point_data.active_normals_name = "normals"

    def _see_through(self, on: bool) -> None:
        if self._actor is not None:
            self._actor.prop.opacity = 0.45 if on else 1.0

    def show_inclusion(self, region: Region | None) -> None:
        """A ball where the inclusion is, seen through the object, or nothing."""
        if region == self._inside:
            return
        self._inside = region
        self._ball.SetVisibility(region is not None)
        self._see_through(region is not None)
        if region is not None:
            self._ball.SetPosition(*region.centre_m)
            self._ball.SetScale(region.radius_m)

    def update(self, frame: Frame, view: RendererView, below: Target | None = None) -> None:
        """Move surface, tip and arrow to a frame; below: what the tip's shadow falls on."""
        moved = view.displacement_m
        if len(moved) == len(self._moved) and not np.array_equal(moved, self._moved):
            self._moved = moved
            self._place_surface()
            self._surface["displacement (mm)"] = 1000.0 * np.linalg.norm(moved, axis=1)[self._lit.at]
        self._tip.SetPosition(*frame.tip_m)
        self._shadow.SetVisibility(below is not None)
        if below is not None:
            height = float(np.linalg.norm(frame.tip_m - below.point))
            self._shadow.prop.opacity = float(np.clip(1.0 - height / SHADOW_FADES_M, 0.2, 1.0))
            self._shadow.SetUserMatrix(_placed(below.point + SHADOW_OFF_M * below.normal, below.normal))
        force = view.force_n
        size = float(np.linalg.norm(force))
        self._arrow.SetVisibility(size > LEAST_ARROW_N)
        if size > LEAST_ARROW_N:
            start = frame.tip_m + self._radius * force / size  # out of the tip, not hidden in it
            self._arrow.SetUserMatrix(arrow_matrix(start, force, min(ARROW_M_PER_N * size, self._longest_m)))


def _ramp(stops: list[str]) -> Any:
    """A map through these colours."""
    from matplotlib.colors import LinearSegmentedColormap

    return LinearSegmentedColormap.from_list("displacement", stops)


def _placed(point: np.ndarray, normal: np.ndarray) -> object:
    """A matrix that takes the plane z = 0 to a point, across a unit normal."""
    matrix = np.eye(4)
    matrix[:3, :3] = np.column_stack([*tangents(normal), normal])
    matrix[:3, 3] = point
    return pyvista.vtkmatrix_from_array(matrix)


def arrow_matrix(start: np.ndarray, direction: np.ndarray, length: float) -> object:
    """A matrix that takes the unit arrow along x to `start`, along `direction`."""
    x = direction / np.linalg.norm(direction)
    y = np.cross([0.0, 0.0, 1.0] if abs(x[2]) < 0.9 else [1.0, 0.0, 0.0], x)
    y /= np.linalg.norm(y)
    matrix = np.eye(4)
    matrix[:3, :3] = length * np.column_stack([x, y, np.cross(x, y)])
    matrix[:3, 3] = start
    return pyvista.vtkmatrix_from_array(matrix)


def _add_support(plotter: pyvista.Plotter, model: Model, points: np.ndarray) -> None:
    size = 1.2 * BESIDE * float(np.linalg.norm(np.ptp(points, axis=0)))
    support = support_plane(model)
    middle = model.mesh.points[model.mesh.fixed].mean(axis=0)
    middle = middle - ((middle - support.point) @ support.normal) * support.normal
    disc = shadow.floor(middle, support.normal, size, points)
    # never seen from below: the eye stays over it
    plotter.add_mesh(
        disc, scalars="shade", rgb=True, lighting=False, culling="back", interpolate_before_map=False
    )
