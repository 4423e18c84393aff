"""What the keys of the touch window do."""

from __future__ import annotations

KEYS: dict[str, str] = {
    "space": "force on / off",
    "Tab": "next renderer",
    "b": "second renderer: hunt-crossley or kelvin-voigt",
    "plus": "stiffer by a quarter",
    "minus": "softer by a fifth",
    "f": "friction: stick, 1, 0.5, 0.2, 0.05",
    "c": "colour by displacement or by local stiffness",
    "i": "stiff inclusion under the tip, again: out",
    "arrows": "move the inclusion, with PageUp and PageDown in height",
    "r": "record, again: write the recording",
    "p": "save a picture",
    "h": "this help",
    "q": "quit",
}
"""Key, in words for the help; the window maps VTK's key symbols to them."""

MOUSE = "move: hover  left: press  wheel: depth\nright: turn  ctrl+wheel: zoom"


def help_text() -> str:
    """Every key, a line each."""
    width = max(map(len, KEYS))
    return "\n".join([*(f"{key:<{width}}  {what}" for key, what in KEYS.items()), "", MOUSE])
