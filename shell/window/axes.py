"""The scene's three directions in a corner of a picture; a letter that would lie on another is left out."""

from __future__ import annotations

import numpy as np
import pyvista
from vtkmodules.vtkRenderingCore import (
    vtkActor2D,
    vtkCoordinate,
    vtkPolyDataMapper2D,
    vtkRenderer,
    vtkTextActor,
)

from palpate.window.lettering import set_type

LENGTH, ROOM = 26.0, 12.0
"""Of an axis, and between letters, pixels of a window of full size."""
COLOURS = {"x": "#b3261e", "y": "#2e7d32", "z": "#1b4f9c"}


class Axes:
    """In a renderer's lower left corner; `update` turns them with the eye."""

    def __init__(self, renderer: vtkRenderer) -> None:
        self._renderer = renderer
        self._lines = pyvista.PolyData()
        self._lines.points = np.zeros((6, 3))
        self._lines.lines = np.array([[2, 0, 1], [2, 2, 3], [2, 4, 5]]).ravel()
        shades = [[*pyvista.Color(colour).int_rgb, 255] for colour in COLOURS.values()]
        self._lines.GetCellData().SetScalars(
            pyvista.convert_array(np.array(shades, dtype=np.uint8), name="shade")
        )
        mapper, place = vtkPolyDataMapper2D(), vtkCoordinate()
        place.SetCoordinateSystemToViewport()
        mapper.SetTransformCoordinate(place)
        mapper.SetInputData(self._lines)
        mapper.SetScalarModeToUseCellData()
        actor = vtkActor2D()
        actor.SetMapper(mapper)
        actor.GetProperty().SetLineWidth(2.0)
        renderer.AddViewProp(actor)
        self.letters = [vtkTextActor() for _ in COLOURS]
        for letter, (name, colour) in zip(self.letters, COLOURS.items(), strict=True):
            letter.SetInput(name)
            set_type(letter.GetTextProperty(), 12, True, colour)
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
        places = middle + (LENGTH + 9.0) * scale * seen
        kept: list[np.ndarray] = []
        for k in np.argsort(-np.linalg.norm(seen, axis=1)):
            letter, at = self.letters[k], places[k]
            free = all(np.linalg.norm(at - other) > ROOM * scale for other in (*kept, middle))
            letter.SetVisibility(free)
            letter.SetPosition(*at)
            if free:
                kept.append(at)
