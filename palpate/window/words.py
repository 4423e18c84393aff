"""What the touch window says in words."""

from __future__ import annotations

import numpy as np

from palpate.window.frames import Frame
from palpate.window.pointer import Pointer
from palpate.window.session import TouchSession
from scenes.scene import Scene


def hint(*, mouse: bool) -> str:
    """What a newcomer needs."""
    first = "left button: press   Ctrl+wheel: how deep" if mouse else "space: force on / off"
    rest = "H: all keys   arrow: force on the tool, 30 mm a newton"
    return f"{first}   right button: turn   wheel: zoom\n{rest}"


def heading(name: str, *, felt: bool) -> str:
    """Over a picture."""
    return f"{name}: what is felt" if felt else f"{name}: for comparison"


def status(session: TouchSession, scene: Scene, pointer: Pointer, frame: Frame, notice: str) -> list[str]:
    """The panel's lines: the object, what is felt, and what goes on."""
    lines = [scene.title]
    if session.feels_inside:
        friction = "sticks" if session.friction == float("inf") else f"friction {session.friction:g}"
        lines = [f"{scene.title}   {session.young_modulus_pa / 1000:.1f} kPa, {friction}"]
    sizes = "   ".join(f"{v.name} {np.linalg.norm(v.force_n):.2f} N" for v in frame.views)
    if frame.touching:
        lines.append(f"{sizes}   {1000 * frame.depth_m:.1f} mm deep")
        lines.append(f"tangent stiffness here {frame.stiffness_n_per_m:.0f} N/m")
    elif any(np.linalg.norm(v.force_n) > 0.0 for v in frame.views):
        lines.append(f"on the support   {sizes}")
    else:
        lines.append(f"in air   a press goes {1000 * pointer.press_depth_m:.1f} mm deep")
    if session.recording is not None:
        traced = f"base traced {100 * session.recording.traced:.0f} %"
        lines.append(f"recording {frame.recorded_s:.0f} s, {traced}")
    return [*lines, *(word for word in (frame.busy, frame.reason, notice) if word)]
