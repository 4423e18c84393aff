"""The last seconds of a session as curves: force and depth over time.

The scene's three directions in a corner of a picture; a letter that would lie on another is left out.

The live plots under the picture: force and depth of the last seconds.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import pyvista
from vtkmodules.vtkRenderingCore import (
    vtkActor2D,
    vtkCoordinate,
    vtkPolyDataMapper2D,
    vtkRenderer,
    vtkTextActor,
)

from palpate.show.colours import COLOURS, GREY, colour_of
from palpate.window.lettering import set_type


class ForceTrace:
    """Rows of (time s, force N, depth m, second renderer's force N), the newest SECONDS of them."""

    COLUMNS, SECONDS = 4, 6.0
    _MOST = 7200  # rows, a fifth more than come at 1 kHz

    def __init__(self) -> None:
        self._rows = np.zeros((0, self.COLUMNS))

    def add(self, rows: np.ndarray) -> None:
        """Append (n, 4) rows; old ones fall off."""
        if len(rows):
            self._rows = np.vstack([self._rows, rows])[-self._MOST :]

    def curves(self, points: int = 600) -> np.ndarray:
        """(k, 4) at most `points` rows; time counts from now, so that it runs from -SECONDS to 0."""
        rows = self._rows
        if not len(rows):
            return np.zeros((0, self.COLUMNS))
        rows = rows[rows[:, 0] > rows[-1, 0] - self.SECONDS]
        shown = rows[:: max(1, len(rows) // points)].copy()
        shown[:, 0] -= rows[-1, 0]
        return shown


LETTER, TITLE, LABEL = 12, 12, 11
"""Sizes of type of the directions and of the charts, in a window of full size."""
LENGTH, ROOM = 26.0, 12.0
"""Of an axis, and between letters, pixels of a window of full size."""
AXES = {name: COLOURS[name] for name in "xyz"}


class AxesGizmo:
    """In a renderer's lower left corner; `update` turns them with the eye."""

    def __init__(self, renderer: vtkRenderer) -> None:
        self._renderer = renderer
        self._lines = pyvista.PolyData()
        self._lines.points = np.zeros((6, 3))
        self._lines.lines = np.array([[2, 0, 1], [2, 2, 3], [2, 4, 5]]).ravel()
        shades = [[*pyvista.Color(colour).int_rgb, 255] for colour in AXES.values()]
        self._lines.GetCellData().SetScalars(
            pyvista.convert_array(np.array(shades, dtype=np.uint8), name="shade")
        )
        mapper, place = vtkPolyDataMapper2D(), vtkCoordinate()
        place.SetCoordinateSystemToViewport()
        mapper.SetTransformCoordinate(place)
        mapper.SetInputData(self._lines)
        mapper.SetScalarModeToUseCellData()
        self._actor = vtkActor2D()
        self._actor.SetMapper(mapper)
        renderer.AddViewProp(self._actor)
        self.letters = [vtkTextActor() for _ in AXES]
        for letter, (name, colour) in zip(self.letters, AXES.items(), strict=True):
            letter.SetInput(name)
            set_type(letter.GetTextProperty(), LETTER, True, colour)
            letter.GetTextProperty().SetJustificationToCentered()
            letter.GetTextProperty().SetVerticalJustificationToCentered()
            letter.GetPositionCoordinate().SetCoordinateSystemToViewport()
            renderer.AddViewProp(letter)

    def update(self, scale: float) -> None:
        """As the renderer's camera stands."""
        camera = self._renderer.GetActiveCamera()
        matrix = camera.GetViewTransformMatrix()
        seen = np.array([[matrix.GetElement(row, axis) for row in (0, 1)] for axis in range(3)])
        middle = np.array([2.0, 2.0]) * LENGTH * scale
        points = np.zeros((6, 3))
        points[::2, :2], points[1::2, :2] = middle, middle + LENGTH * scale * seen
        self._lines.points = points
        self._actor.GetProperty().SetLineWidth(2.0 * scale)
        places = middle + (LENGTH + 9.0) * scale * seen
        kept: list[np.ndarray] = []
        for k in np.argsort(-np.linalg.norm(seen, axis=1)):
            letter, at = self.letters[k], places[k]
            free = all(np.linalg.norm(at - other) > ROOM * scale for other in (*kept, middle))
            letter.GetTextProperty().SetFontSize(round(LETTER * scale))
            letter.SetVisibility(free)
            letter.SetPosition(*at)
            if free:
                kept.append(at)


LEAST_N, LEAST_MM = 0.5, 2.0
"""What the axes reach at least."""


class LiveCharts:
    """Two charts on the plotter's active subplot; a second renderer's force is dashed over the first's."""

    def __init__(self, plotter: pyvista.Plotter, seconds: float) -> None:
        self._force = self._chart(plotter, 0.0, "force (N)", seconds, LEAST_N)
        self._depth = self._chart(plotter, 0.5, "depth (mm)", seconds, LEAST_MM)
        nothing = np.zeros(2), np.zeros(2)
        self._lines = [
            self._force.line(*nothing, color=colour, width=2.0, style=style)
            for colour, style in ((COLOURS["fem"], "-"), (COLOURS["hunt-crossley"], "--"))
        ]
        self._deep = self._depth.line(*nothing, color=COLOURS["depth"], width=2.0)
        self.tell(["fem"])

    @staticmethod
    def _chart(
        plotter: pyvista.Plotter, left: float, label: str, seconds: float, least: float
    ) -> pyvista.Chart2D:
        chart = pyvista.Chart2D(size=(0.5, 1.0), loc=(left, 0.0), x_label="time (s)", y_label=label)
        chart.x_range, chart.y_range = [-seconds, 0.0], [0.0, least]
        chart.x_axis.tick_count = round(seconds) + 1  # on a large window there would be too many to be read
        chart.background_color = chart.border_color = "white"
        for axis in (chart.x_axis, chart.y_axis):
            set_type(axis.GetTitleProperties(), TITLE, False, GREY)
            set_type(axis.GetLabelProperties(), LABEL, False, GREY)
        plotter.add_chart(chart)
        return chart

    def scale(self, scale: float) -> None:
        """Letters and lines as large as the window is, against one of full size."""
        for axis in (axis for chart in (self._force, self._depth) for axis in (chart.x_axis, chart.y_axis)):
            axis.GetTitleProperties().SetFontSize(round(TITLE * scale))
            axis.GetLabelProperties().SetFontSize(round(LABEL * scale))
        for line in (*self._lines, self._deep):
            line.width = 2.0 * scale

    def tell(self, names: Sequence[str]) -> None:
        """Whose forces are drawn, each in its renderer's colour; what is felt first."""
        self._told = len(names)
        for line in self._lines[len(names) :]:
            line.visible = False
        for line, name in zip(self._lines, names, strict=False):
            line.color = colour_of(name)

    def update(self, trace: ForceTrace) -> None:
        """Redraw from the trace; the range grows with the greatest value shown."""
        curves = trace.curves()
        if len(curves) < 2:
            return
        time_s = curves[:, 0]
        for line, column in zip(self._lines[: self._told], (1, 3), strict=False):
            line.update(time_s, curves[:, column])
        self._deep.update(time_s, 1000.0 * curves[:, 2])
        self._force.y_range = [0.0, max(LEAST_N, 1.15 * curves[:, (1, 3)].max())]
        self._depth.y_range = [0.0, max(LEAST_MM, 1.15 * 1000.0 * curves[:, 2].max())]
