"""A result in a notebook: its words, the view of the pages, and its plot; an object, to be pressed."""

from __future__ import annotations

import base64
import gzip
import html
import sys
from typing import TYPE_CHECKING

from palpate.mechanics.progress import Progress, silent
from palpate.show.page import Page, file_text, png_bytes
from palpate.show.view3d import View

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from palpate.mechanics.model.model import Model

VIEW_PX, PAGE_PX = 560, 760


def in_notebook() -> bool:
    """Whether this runs in a notebook's kernel."""
    shell = getattr(sys.modules.get("IPython"), "get_ipython", lambda: None)()
    return type(shell).__name__ == "ZMQInteractiveShell"


def cell(words: str, view: View | None, figure: Figure) -> str:
    """HTML of a result: its words, the view where it has one, and the plot, which is folded beneath a view. A
    notebook that is not trusted shows words and plot."""
    drawn = f'<img src="data:image/png;base64,{base64.b64encode(png_bytes(figure)).decode()}">'
    said = f"<pre>{html.escape(words)}</pre>"
    if view is None:
        return said + drawn
    title = words.partition("\n")[0]
    return f"{said}{framed_view(view, title)}<details><summary>its plot</summary>{drawn}</details>"


def framed_view(view: View, title: str) -> str:
    """HTML of a frame with the view."""
    page = Page(title, bare=True)
    page.turned(view, "<p>This browser draws no 3D (WebGL).</p>")
    return framed(page.html(), title, VIEW_PX)


def framed(page: str, title: str, height_px: int) -> str:
    """HTML of a frame that holds a page whole, packed and offline, its scripts apart from the notebook's."""
    packed = base64.b64encode(gzip.compress(page.encode(), 9, mtime=0)).decode()
    inside = file_text("frame.html").replace("{{page}}", packed)
    # inside a division: of a bare frame IPython says to use its own, which knows addresses alone
    return (
        f'<div><iframe srcdoc="{html.escape(inside)}" title="{html.escape(title)}" width="100%" '
        f'height="{height_px}" style="border:0"></iframe></div>'
    )


def show_view(view: View, title: str) -> None:
    """Put the view into the output of the cell that runs."""
    _display(framed_view(view, title))


def show_page_to_press(model: Model, progress: Progress = silent) -> None:
    """Put the page in which a model can be pressed into the output of the cell that runs."""
    from palpate.exporting.page.document import page_of
    from palpate.render.fem.renderer import FemRenderer

    _display(framed(page_of(FemRenderer(model, progress=progress), None, progress), model.name, PAGE_PX))


def _display(text: str) -> None:
    from IPython import display

    display.display(display.HTML(text))
