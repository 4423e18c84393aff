"""A result in a notebook: its words with the plot under them, and the view of the pages, to be turned."""

from __future__ import annotations

import base64
import html
import sys
from typing import TYPE_CHECKING

from palpate.show.page import Page, png_bytes
from palpate.show.view3d import View

if TYPE_CHECKING:
    from matplotlib.figure import Figure

HEIGHT_PX = 620


def in_notebook() -> bool:
    """Whether this runs in a notebook's kernel."""
    shell = getattr(sys.modules.get("IPython"), "get_ipython", lambda: None)()
    return type(shell).__name__ == "ZMQInteractiveShell"


def words_and_picture(words: str, figure: Figure) -> str:
    """HTML of a text with a picture under it."""
    picture = base64.b64encode(png_bytes(figure)).decode()
    return f'<pre>{html.escape(words)}</pre><img src="data:image/png;base64,{picture}">'


def show_view(view: View, title: str, figure: Figure) -> None:
    """Put a frame with the view, whole and offline, into the output of the cell that runs; figure: for where
    scripts are off."""
    from IPython import display

    page = Page(title)
    page.view(view, figure, title)
    # inside a division: of a bare frame IPython says to use its own, which knows addresses alone
    frame = (
        f'<div><iframe srcdoc="{html.escape(page.html())}" title="{html.escape(title)}" width="100%" '
        f'height="{HEIGHT_PX}" style="border:0"></iframe></div>'
    )
    display.display(display.HTML(frame))
