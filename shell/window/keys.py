"""What mouse and keys of the touch window do, in words; buttons are made of the same list.

Where the eye stands: a turntable round the object, which keeps up with every drag and never sinks.

Angles and distance are kept here and the camera is set from them each time, so that a view cannot be lost: it
is the same after any number of drags there and back.
"""

from __future__ import annotations

import math
from collections.abc import Container
from dataclasses import dataclass

import numpy as np
from vtkmodules.vtkRenderingCore import vtkCamera

from palpate.window.widgets import Item, Row
from palpate.window.worker import level


@dataclass(frozen=True)
class KeyBinding:
    """does: for help and a button's tip. button: its words, '' for a key without a button. group: of buttons,
    in which it stands. rare: folded away until all are asked for."""

    does: str
    button: str = ""
    group: str = "Session"
    rare: bool = False


KEYS: dict[str, KeyBinding] = {
    "Return": KeyBinding("The nodule is where you pressed last", "It is here", "Touch"),
    "b": KeyBinding(
        "Show a second renderer under the same tip, or only what you feel", "Side by side", "Touch"
    ),
    "Tab": KeyBinding("Feel the next renderer", "Next renderer", "Touch", rare=True),
    "c": KeyBinding(
        "Colour by the stiffness at the depth of a press, or by displacement", "Stiffness map", "Look"
    ),
    "i": KeyBinding("Put a stiff ball under the tip, or take it out", "Stiff ball", "Touch"),
    "r": KeyBinding("Record what you do; again: write the recording", "Record"),
    "p": KeyBinding("Save this window as a picture", "Save picture", "Look", rare=True),
    "v": KeyBinding("Look from where you began", "First view", "Look"),
    "space": KeyBinding("Switch the device's force on or off", "Force", "Touch"),
    "s": KeyBinding("Renderer, friction, stiffness, depth, effects", "Settings", "Touch"),
    "h": KeyBinding("What mouse and keys do", "Help"),
    "g": KeyBinding("Leave this object and choose another", "Scenes"),
    "Escape": KeyBinding("Close Settings or Help"),
    "q": KeyBinding("Force off, and close the window", "Quit"),
    "m": KeyBinding("Show all buttons, or fold the rarer ones away", "More"),
    "plus": KeyBinding("Stiffer by a quarter"),
    "minus": KeyBinding("Softer by a fifth"),
    "bracketleft": KeyBinding("Press less deep"),
    "bracketright": KeyBinding("Press deeper"),
    "f": KeyBinding("Next friction: stick, 1, 0.5, 0.2, 0.05"),
    "arrows": KeyBinding("Move the ball, with PageUp and PageDown in height"),
}
"""By name; palpate.window.mouse_and_keys maps VTK's key symbols to these."""

SHOWN = {
    "plus": "+",
    "minus": "−",
    "bracketleft": "[",
    "bracketright": "]",
    "Return": "Enter",
    "Escape": "Esc",
    "space": "Space",
    "arrows": "Arrows",
}

MOUSE = {
    "Move": "Hover over the object",
    "Left": "Press; drag sideways",
    "Wheel": "Zoom; with Ctrl, or while pressing: how deep",
    "Right": "Turn the view; with Shift: move it",
}
BALL = {"Middle": "Drag the ball (or Shift and left; wheel: nearer, farther)"}


def shown(key: str) -> str:
    """As it stands on a keyboard."""
    return SHOWN.get(key, key.upper() if len(key) == 1 else key)


def help_rows(offered: Container[str]) -> list[Row]:
    """Every button of the mouse, and every key that does something now."""
    lines = {**MOUSE, **(BALL if "arrows" in offered else {})}
    lines |= {shown(name): key.does for name, key in KEYS.items() if name in offered}
    return [
        (Item(name, bold=True, size=12, wide=0.27), Item(does, size=12, wide=0.73))
        for name, does in lines.items()
    ]


TURN_A_HEIGHT = math.pi
"""Radians that a drag over the whole picture turns."""
LOWEST, HIGHEST = math.radians(2.0), math.radians(88.0)
NEAREST, FARTHEST = 0.3, 4.0
"""Times the distance of the beginning."""
ZOOM_A_STEP = 1.12


class Orbit:
    """Moves a camera about `middle_m` (3,); up: the support's unit normal, over which the eye stays.

    from_m: (3,) m where the eye begins.
    """

    def __init__(self, camera: vtkCamera, middle_m: np.ndarray, up: np.ndarray, from_m: np.ndarray) -> None:
        self._camera = camera
        self._up = np.array(up, dtype=float)
        away = level(self._up)
        self._axes = np.column_stack([np.cross(away, self._up), away])
        offset = np.asarray(from_m, dtype=float) - middle_m
        self._begin_m = float(np.linalg.norm(offset))
        flat = self._axes.T @ offset
        height = float(np.arcsin(offset @ self._up / self._begin_m))
        self._home = (float(np.arctan2(flat[1], flat[0])), height, self._begin_m)
        self._home_middle = np.array(middle_m, dtype=float)
        self.reset()

    def reset(self) -> None:
        """Back to where it began."""
        self._azimuth, self._height, self._distance_m = self._home
        self._middle = self._home_middle.copy()
        self._apply()

    @property
    def stands(self) -> tuple[float, float]:
        """Where the eye stands about the vertical and over the horizon, rad."""
        return self._azimuth, self._height

    def turn(self, across: float, upwards: float) -> None:
        """A drag by shares of the picture's height: the object follows the mouse."""
        self._azimuth -= TURN_A_HEIGHT * across
        self._height = float(np.clip(self._height - TURN_A_HEIGHT * upwards, LOWEST, HIGHEST))
        self._apply()

    def zoom(self, steps: float) -> None:
        """Nearer by a step, farther by a negative one."""
        wanted = self._distance_m / ZOOM_A_STEP**steps
        self._distance_m = float(np.clip(wanted, NEAREST * self._begin_m, FARTHEST * self._begin_m))
        self._apply()

    def pan(self, across: float, upwards: float) -> None:
        """A drag by shares of the picture's height: what is looked at moves with the mouse."""
        camera = self._camera
        height_m = 2.0 * self._distance_m * math.tan(math.radians(camera.GetViewAngle()) / 2.0)
        back = np.array(camera.GetPosition()) - self._middle
        right = np.cross(self._up, back)
        right /= np.linalg.norm(right)
        over = np.cross(back, right) / np.linalg.norm(back)
        moved = self._middle - height_m * (across * right + upwards * over)
        off = moved - self._home_middle
        # the object stays in reach, and what is looked at over the floor
        off *= min(1.0, self._begin_m / max(float(np.linalg.norm(off)), 1e-12))
        off += max(0.0, -float(off @ self._up)) * self._up
        self._middle = self._home_middle + off
        self._apply()

    def _apply(self) -> None:
        flat = self._axes @ [math.cos(self._azimuth), math.sin(self._azimuth)]
        eye = math.cos(self._height) * flat + math.sin(self._height) * self._up
        camera = self._camera
        camera.SetFocalPoint(*self._middle)
        camera.SetPosition(*(self._middle + self._distance_m * eye))
        camera.SetViewUp(*self._up)
        camera.SetClippingRange(0.02 * self._distance_m, self._distance_m + 6.0 * self._begin_m)
