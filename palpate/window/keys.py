"""What mouse and keys of the touch window do, in words."""

from __future__ import annotations

KEYS: dict[str, str] = {
    "space": "force on / off",
    "Tab": "next renderer",
    "b": "second renderer: hunt-crossley or kelvin-voigt",
    "plus": "stiffer by a quarter",
    "minus": "softer by a fifth",
    "f": "friction: stick, 1, 0.5, 0.2, 0.05",
    "c": "colour by displacement or by local stiffness",
    "i": "stiff ball under the tip, again: out",
    "arrows": "move the ball, with PageUp and PageDown in height",
    "r": "record, again: write the recording",
    "p": "save a picture",
    "h": "this help",
    "q": "quit",
}
"""Key, in words for the help; palpate.window.controls maps VTK's key symbols to them."""

MOUSE: dict[str, str] = {
    "move": "hover",
    "left": "press, and drag sideways",
    "wheel": "how deep",
    "right": "turn the view, ctrl+wheel: zoom",
    "middle": "drag the ball (or shift+left; wheel: nearer, farther)",
}


def help_text() -> str:
    """Every key and button, a line each."""
    width = max(map(len, (*KEYS, *MOUSE)))
    lines = [f"{key:<{width}}  {what}" for key, what in (*MOUSE.items(), *KEYS.items())]
    return "\n".join(lines)
