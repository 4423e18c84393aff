"""A result as a notebook shows it: the view that every page has, to be turned in the cell's output."""

from __future__ import annotations

import html
import sys
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from palpate.report.view3d import View

HEIGHT_PX = 620


def in_notebook() -> bool:
    """Whether this runs in a notebook's kernel."""
    shell = getattr(sys.modules.get("IPython"), "get_ipython", lambda: None)()
    return type(shell).__name__ == "ZMQInteractiveShell"


def frame(view: View, title: str, picture: Any) -> str:
    """HTML of a frame with the view in it, whole and offline; picture: for where scripts are off."""
    from palpate.report.page import Page

    page = Page(title)
    page.view(view, picture, title)
    # inside a division: of a bare frame IPython says to use its own, which knows addresses alone
    return (
        f'<div><iframe srcdoc="{html.escape(page.html())}" title="{html.escape(title)}" width="100%" '
        f'height="{HEIGHT_PX}" style="border:0"></iframe></div>'
    )


def display(text: str) -> None:
    """Put HTML into the output of the cell that runs."""
    from IPython import display as shown

    shown.display(shown.HTML(text))
