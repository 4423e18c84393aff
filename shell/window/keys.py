"""What mouse and keys of the touch window do, in words; buttons are made of the same list."""

from __future__ import annotations

from collections.abc import Container
from dataclasses import dataclass

from palpate.window.widgets import Item, Row


@dataclass(frozen=True)
class Key:
    """does: for help and a button's tip. button: its words, '' for a key without a button."""

    does: str
    button: str = ""


KEYS: dict[str, Key] = {
    "Return": Key("The nodule is where the tip is", "It is here"),
    "b": Key("Show a second renderer under the same tip, or only what you feel", "Side by side"),
    "Tab": Key("Feel the next renderer", "Next renderer"),
    "c": Key("Colour by the stiffness of a 3 mm press, or by displacement", "Stiffness map"),
    "i": Key("Put a stiff ball under the tip, or take it out", "Stiff ball"),
    "r": Key("Record what you do; again: write the recording", "Record"),
    "p": Key("Save this window as a picture", "Save picture"),
    "v": Key("Look from where you began", "First view"),
    "space": Key("Switch the device's force on or off", "Force"),
    "s": Key("Renderer, friction, stiffness, depth, effects", "Settings"),
    "h": Key("What mouse and keys do", "Help"),
    "g": Key("Leave this object and choose another", "Scenes"),
    "q": Key("Force off, and close the window", "Quit"),
    "plus": Key("Stiffer by a quarter"),
    "minus": Key("Softer by a fifth"),
    "bracketleft": Key("Press less deep"),
    "bracketright": Key("Press deeper"),
    "f": Key("Next friction: stick, 1, 0.5, 0.2, 0.05"),
    "arrows": Key("Move the ball, with PageUp and PageDown in height"),
}
"""By name; palpate.window.mouse_and_keys maps VTK's key symbols to these."""

SHOWN = {
    "plus": "+",
    "minus": "−",
    "bracketleft": "[",
    "bracketright": "]",
    "Return": "Enter",
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
