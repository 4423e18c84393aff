"""Words, buttons and sliders in a rectangle of a window: rows that are told anew at every picture.

What is shown is a list of rows, made from the state; only what changed is drawn anew. All places are pixels
of the window, counted from its lower left.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np
import pyvista
from vtkmodules.vtkCommonCore import VTK_TEXT_CENTERED, VTK_TEXT_LEFT, VTK_TEXT_TOP
from vtkmodules.vtkRenderingCore import (
    vtkActor2D,
    vtkCoordinate,
    vtkPolyDataMapper2D,
    vtkRenderer,
    vtkTextActor,
)

from palpate.show.colours import ACCENT, BUTTON, INK, NIGHT, OVER, PAPER
from palpate.window.lettering import cut, set_type, text_width, wrapped

SIZE = (1280, 800)
"""Of a window at full size, pixels."""
_BESIDE = (16, 88)
"""What frame, title and task bar take of a screen, pixels."""
BODY = 13
"""Size of type in pixels, of a window of full size."""
MARGIN, GAP, BUTTON_HEIGHT, SLIDER_HEIGHT, LINE = 14, 6, 30, 20, 1.32
LEAST_TYPE = 8


@dataclass(frozen=True)
class Item:
    """Words; a button where it does something; a slider or a bar where it has a share.

    tip: what a button does, shown while the mouse is over it. on: chosen. share: 0 to 1, of a bar, or of a
    slider that calls `slide` with another. fill: colour behind the words. wide: of its row, relative.
    least_lines: room for so many, so that what follows stays where it is.
    """

    text: str
    do: Callable[[], object] | None = field(default=None, compare=False)
    tip: str = ""
    on: bool = False
    size: int = BODY
    bold: bool = False
    colour: str = INK
    fill: str = ""
    share: float | None = None
    slide: Callable[[float], object] | None = field(default=None, compare=False)
    wide: float = 1.0
    least_lines: int = 1


Row = tuple[Item, ...]
Rectangle = tuple[float, float, float, float]
"""Left, bottom, right, top, pixels."""


@dataclass(frozen=True)
class _Words:
    text: str
    at: tuple[float, float]
    size: int
    bold: bool
    colour: str
    centred: bool = False


def fit_screen(plotter: pyvista.Plotter) -> None:
    """Make a window no larger than what its screen has room for: the foot of one that is cannot be seen."""
    if not plotter.off_screen and plotter.render_window is not None:
        plotter.window_size = list(fitted(plotter.window_size, plotter.render_window.GetScreenSize()))


def fitted(size: Sequence[int], screen: Sequence[int]) -> tuple[int, ...]:
    """A window's size, pixels, on a screen of this size."""
    return tuple(min(own, there - taken) for own, there, taken in zip(size, screen, _BESIDE, strict=True))


class Board:
    """In a renderer; `place` says where, `show` what; press, hover, drag and release take the mouse's pixels.

    fill: behind everything, '' for nothing. changed: whether it looks otherwise than it was drawn last.
    """

    def __init__(self, renderer: vtkRenderer, *, fill: str = "") -> None:
        self._renderer = renderer
        self.fill = fill
        self.scale = 1.0
        self.changed = True
        self._rectangle: Rectangle = (0.0, 0.0, 1.0, 1.0)
        self._rows: list[Row] = []
        self._shown: object = None
        self.placed: list[tuple[Item, Rectangle]] = []
        self._over: int | None = None
        self._held: tuple[Item, Rectangle] | None = None
        self._boxes, under = _quads()
        self._hint, over = _quads()
        self._texts: list[vtkTextActor] = []
        # of a tip: drawn after all others
        self._last = [over, _text_actor()]
        renderer.AddViewProp(under)
        renderer.AddObserver("EndEvent", lambda *_: self._drawn())

    def _drawn(self) -> None:
        self.changed = self.changed and not self._renderer.GetDraw()

    def place(self, left: float, bottom: float, right: float, top: float, scale: float) -> None:
        """Cover this rectangle; scale: of type and gaps."""
        self._rectangle, self.scale = (left, bottom, right, top), scale

    def show(self, rows: Sequence[Row]) -> None:
        """These rows, from the top downwards; draws nothing anew that is as it was."""
        self._rows = [row for row in rows if row]
        state = (self._rows, self._rectangle, self.scale, self._over, self.fill)
        if state == self._shown:  # what buttons do may be new all the same
            self.placed = [
                (item, at)
                for item, (_, at) in zip(
                    (item for row in self._rows for item in row), self.placed, strict=True
                )
            ]
            return
        self._shown = state
        self._draw()

    def _draw(self) -> None:
        self.changed = True
        scale, gap = self.scale, GAP * self.scale
        left, bottom, right, top = self._rectangle
        boxes: list[tuple[Rectangle, str]] = [(self._rectangle, self.fill)] if self.fill else []
        words: list[_Words] = []
        self.placed = []
        inner_left, inner_right = left + MARGIN * scale, right - MARGIN * scale
        y = top - MARGIN * scale
        for row in self._rows:
            free = inner_right - inner_left - gap * (len(row) - 1)
            share = sum(item.wide for item in row)
            widths = [free * item.wide / share for item in row]
            height = max(self._height(item, width) for item, width in zip(row, widths, strict=True))
            x = inner_left
            for item, width in zip(row, widths, strict=True):
                at = (x, y - height, x + width, y)
                self._one(item, at, boxes, words, over=len(self.placed) == self._over)
                self.placed.append((item, at))
                x += width + gap
            y -= height + gap
        _fill(self._boxes, boxes, 5.0 * scale)
        self._write(words)
        self._tip((inner_left, bottom, inner_right, top))

    def _height(self, item: Item, width: float) -> float:
        if item.do is not None:
            return (BUTTON_HEIGHT - 5 * (item.size < BODY)) * self.scale
        if item.share is not None:
            return SLIDER_HEIGHT * self.scale
        lines = max(item.least_lines, len(self._lines(item, width)))
        more = 2 * GAP * self.scale if item.fill else 0.0
        return self._type(item.size) * (LINE * (lines - 1) + 1.0) + more

    def _lines(self, item: Item, width: float) -> list[str]:
        inset = 4 * GAP * self.scale if item.fill else 0.0
        return wrapped(item.text, self._type(item.size), item.bold, width - inset)

    def _type(self, size: int) -> int:
        return max(LEAST_TYPE, round(size * self.scale))

    def _one(
        self,
        item: Item,
        at: Rectangle,
        boxes: list[tuple[Rectangle, str]],
        words: list[_Words],
        *,
        over: bool,
    ) -> None:
        left, bottom, right, top = at
        middle = 0.5 * (bottom + top)
        size = self._type(item.size)
        if item.do is not None:
            boxes.append((at, ACCENT if item.on else OVER if over else item.fill or BUTTON))
            colour = PAPER if item.on else item.colour
            fits = cut(item.text, size, item.bold, right - left - GAP * self.scale)
            at_middle = (0.5 * (left + right), middle)
            words.append(_Words(fits, at_middle, size, item.bold, colour, centred=True))
        elif item.share is not None:
            thick = (3.0 if item.slide else 5.0) * self.scale
            reached = left + min(max(item.share, 0.0), 1.0) * (right - left)
            boxes.append(((left, middle - thick, right, middle + thick), BUTTON))
            boxes.append(((left, middle - thick, reached, middle + thick), ACCENT))
            if item.slide is not None:
                half = 7.0 * self.scale
                boxes.append(((reached - half, middle - half, reached + half, middle + half), ACCENT))
        else:
            inset = 0.0
            if item.fill:
                boxes.append((at, item.fill))
                inset = 2 * GAP * self.scale
            text = "\n".join(self._lines(item, right - left))
            place = (left + inset, top - (GAP * self.scale if item.fill else 0.0))
            words.append(_Words(text, place, size, item.bold, item.colour))

    def _tip(self, inner: Rectangle) -> None:
        """Of the button that the mouse is over: under it, or over it where there is no room."""
        for actor in self._last:
            self._renderer.RemoveViewProp(actor)
        if self._over is None or self._over >= len(self.placed) or not self.placed[self._over][0].tip:
            return
        item, at = self.placed[self._over]
        size, pad = self._type(BODY - 1), GAP * self.scale
        lines = wrapped(item.tip, size, False, inner[2] - inner[0] - 2 * pad)
        height = size * LINE * len(lines) + 2 * pad
        width = max(text_width(line, size, False) for line in lines) + 2 * pad
        left = min(at[0], inner[2] - width)
        top = at[1] - 4.0 if at[1] - 4.0 - height > inner[1] else at[3] + 4.0 + height
        _fill(self._hint, [((left, top - height, left + width, top), NIGHT)], 5.0 * self.scale)
        box, words = self._last
        _set(words, _Words("\n".join(lines), (left + pad, top - pad), size, False, PAPER))
        for actor in (box, words):
            self._renderer.AddViewProp(actor)

    def _write(self, words: list[_Words]) -> None:
        while len(self._texts) < len(words):
            self._texts.append(_text_actor())
            self._renderer.AddViewProp(self._texts[-1])
        for actor, each in zip(self._texts, words, strict=False):
            _set(actor, each)
        for k, actor in enumerate(self._texts):
            actor.SetVisibility(k < len(words))

    def holds(self, x: float, y: float) -> bool:
        """Whether the pixel is on the board."""
        return _within(self._rectangle, x, y)

    def _at(self, x: float, y: float, *, told: bool = False) -> int | None:
        """What can be pressed here; told: or says what it is."""
        found = (
            k
            for k, (item, at) in enumerate(self.placed)
            if (item.do or item.slide or (told and item.tip)) and _within(at, x, y)
        )
        return next(found, None)

    def hover(self, x: float, y: float) -> None:
        """The mouse is here: a button lights up and says what it does, words what they are called."""
        over = self._at(x, y, told=True)
        if over != self._over:
            self._over = over
            self.show(self._rows)

    def press(self, x: float, y: float) -> bool:
        """The button went down; whether it was on this board."""
        found = self._at(x, y)
        if found is not None:
            item, at = self.placed[found]
            if item.do is not None:
                item.do()
            else:
                self._held = item, at
                self.drag(x)
        return found is not None or self.holds(x, y)

    def drag(self, x: float) -> bool:
        """The mouse moves with a slider in hand; False without one."""
        if self._held is None:
            return False
        item, (left, _, right, _) = self._held
        assert item.slide is not None
        item.slide(float(np.clip((x - left) / (right - left), 0.0, 1.0)))
        return True

    def release(self) -> bool:
        """The button came up; whether a slider was in hand."""
        held, self._held = self._held, None
        return held is not None

    def find(self, text: str) -> tuple[float, float]:
        """The middle of the button, slider or words of this text; raises KeyError for what is not shown."""
        for item, (left, bottom, right, top) in self.placed:
            if item.text == text:
                return 0.5 * (left + right), 0.5 * (bottom + top)
        raise KeyError(text)

    @property
    def text(self) -> str:
        """All words, a row a line."""
        return "\n".join("  ".join(item.text for item in row) for row in self._rows)


def _quads() -> tuple[pyvista.PolyData, vtkActor2D]:
    """Flat shapes in the window's pixels, to be filled, and what draws them."""
    boxes, actor = pyvista.PolyData(), vtkActor2D()
    mapper, place = vtkPolyDataMapper2D(), vtkCoordinate()
    place.SetCoordinateSystemToDisplay()
    mapper.SetTransformCoordinate(place)
    mapper.SetInputData(boxes)
    mapper.SetScalarModeToUseCellData()
    actor.SetMapper(mapper)
    return boxes, actor


def _text_actor() -> vtkTextActor:
    actor = vtkTextActor()
    actor.GetPositionCoordinate().SetCoordinateSystemToDisplay()
    return actor


def _set(actor: vtkTextActor, words: _Words) -> None:
    prop = actor.GetTextProperty()
    set_type(prop, words.size, words.bold, words.colour)
    prop.SetJustification(VTK_TEXT_CENTERED if words.centred else VTK_TEXT_LEFT)
    prop.SetVerticalJustification(VTK_TEXT_CENTERED if words.centred else VTK_TEXT_TOP)
    actor.SetInput(words.text)
    actor.SetPosition(round(words.at[0]), round(words.at[1]))


def _within(at: Rectangle, x: float, y: float) -> bool:
    return at[0] <= x <= at[2] and at[1] <= y <= at[3]


_CORNER = np.linspace(0.0, np.pi / 2, 5)


def _fill(data: pyvista.PolyData, boxes: list[tuple[Rectangle, str]], radius: float) -> None:
    """Rounded rectangles, each in its colour."""
    points, colours = [], []
    for (left, bottom, right, top), colour in boxes:
        r = min(radius, 0.5 * (right - left), 0.5 * (top - bottom))
        for quarter, (x, y) in enumerate(
            ((right - r, top - r), (left + r, top - r), (left + r, bottom + r), (right - r, bottom + r))
        ):
            angle = _CORNER + quarter * np.pi / 2
            points.append(np.column_stack([x + r * np.cos(angle), y + r * np.sin(angle), 0.0 * angle]))
        colours.append([*pyvista.Color(colour).int_rgb, 255])
    corners = 4 * len(_CORNER)
    data.points = np.concatenate(points) if points else np.zeros((0, 3))
    faces: Any = np.arange(corners * len(boxes)).reshape(-1, corners)
    data.regular_faces = faces
    shades = pyvista.convert_array(np.array(colours, dtype=np.uint8).reshape(-1, 4), name="colour")
    data.GetCellData().SetScalars(shades)
    data.Modified()
