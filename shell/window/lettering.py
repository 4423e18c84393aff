"""The window's type: one face, how wide words are in it, and where their lines break."""

from __future__ import annotations

import importlib.util
from functools import cache, lru_cache
from pathlib import Path
from typing import Any

import pyvista
from vtkmodules.vtkCommonCore import VTK_FONT_FILE
from vtkmodules.vtkRenderingCore import vtkTextProperty, vtkTextRenderer

KEPT = 4096
"""Of measured words: numbers that run through would fill any memory."""
_FONTS = {False: "DejaVuSans.ttf", True: "DejaVuSans-Bold.ttf"}


@cache
def font_file(bold: bool) -> str:
    """The face of the window's type, which comes with Matplotlib; '' where that has none."""
    spec = importlib.util.find_spec("matplotlib")
    folder = Path(spec.origin).parent if spec is not None and spec.origin else Path()
    path = folder / "mpl-data" / "fonts" / "ttf" / _FONTS[bold]
    return str(path) if path.is_file() else ""


def set_type(prop: vtkTextProperty, size: int, bold: bool, colour: str) -> None:
    """The window's type."""
    file = font_file(bold)
    if file:
        prop.SetFontFamily(VTK_FONT_FILE)
        prop.SetFontFile(file)
    else:
        prop.SetFontFamilyToArial()
        prop.SetBold(bold)
    prop.SetFontSize(size)
    prop.SetColor(*pyvista.Color(colour).float_rgb)


@cache
def _measure() -> tuple[Any, vtkTextProperty]:
    return vtkTextRenderer.GetInstance(), vtkTextProperty()


@lru_cache(KEPT)
def text_width(text: str, size: int, bold: bool) -> float:
    """Pixels."""
    renderer, prop = _measure()
    set_type(prop, size, bold, "black")
    box = [0] * 4
    renderer.GetBoundingBox(prop, text or " ", box, 72)
    return float(box[1] - box[0])


@lru_cache(KEPT)
def wrapped(text: str, size: int, bold: bool, width: float) -> list[str]:
    """Lines that are no wider, broken between words."""
    lines: list[str] = []
    for part in text.split("\n"):
        line = ""
        for word in part.split(" "):
            longer = f"{line} {word}" if line else word
            if line and text_width(longer, size, bold) > width:
                lines.append(line)
                line = word
            else:
                line = longer
        lines.append(line)
    return lines


@lru_cache(KEPT)
def cut(text: str, size: int, bold: bool, width: float) -> str:
    """The text, or as much of it as fits."""
    if text_width(text, size, bold) <= width:
        return text
    return next((f"{text[:n]}…" for n in range(len(text), 1, -1)
                 if text_width(f"{text[:n]}…", size, bold) <= width), text[:1])  # fmt: skip
