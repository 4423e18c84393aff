"""What mouse and keys of the touch window do, in words."""

from __future__ import annotations

from collections.abc import Container

KEYS: dict[str, str] = {
    "space": "force on / off",
    "Tab": "feel the next renderer",
    "b": "compare with the next one: hunt-crossley, kelvin-voigt",
    "plus": "stiffer by a quarter",
    "minus": "softer by a fifth",
    "bracketleft": "press less deep",
    "bracketright": "press deeper",
    "f": "friction: stick, 1, 0.5, 0.2, 0.05",
    "c": "colour by displacement or by stiffness",
    "i": "stiff ball under the tip, again: out",
    "arrows": "move the ball, with PageUp and PageDown in height",
    "Return": "the nodule is here",
    "v": "the view of the beginning",
    "r": "record, again: write the recording",
    "p": "save a picture",
    "h": "this help",
    "q": "quit",
}
"""Key, in words for the help; palpate.window.controls maps VTK's key symbols to them."""

SHOWN = {"plus": "+", "minus": "-", "bracketleft": "[", "bracketright": "]", "Return": "Enter"}

MOUSE: dict[str, str] = {
    "move": "hover",
    "left": "press, and drag sideways",
    "wheel": "zoom; with Ctrl, or while pressing: how deep",
    "right": "turn the view; with Shift: move it",
}
BALL = {"middle": "drag the ball (or Shift+left; wheel: nearer, farther)"}


def help_text(offered: Container[str]) -> str:
    """Every button, and every key that does something now, a line each."""
    buttons = {**MOUSE, **(BALL if "arrows" in offered else {})}
    keys = {SHOWN.get(key, key): what for key, what in KEYS.items() if key in offered}
    width = max(map(len, (*keys, *buttons)))
    return "\n".join(f"{key:<{width}}  {what}" for key, what in (*buttons.items(), *keys.items()))
