"""The button "press it" of a report: it opens the page of the report's object, which the report carries."""

from __future__ import annotations

import base64
import gzip
import html

from palpate.exporting.page.document import file, page_of
from palpate.mechanics.model.model import Model
from palpate.render.fem.renderer import FemRenderer


def button(model: Model) -> str:
    """HTML of the button. Where the object's compliance is not kept in its folder yet, which takes a while to
    compute, the button says by which command the page is made instead."""
    if not _at_hand(model):
        folder = html.escape(str(model.path or "MODEL"))
        return (
            '<details class="press-it"><summary>press it</summary><p>A page in which this object '
            "can be pressed, by mouse, finger or keyboard, in any browser: "
            f"<code>palpate export {folder} --to page -o touch.html</code></p></details>"
        )
    page = gzip.compress(page_of(FemRenderer(model)).encode(), 9, mtime=0)
    return file("button.html").replace("{{page}}", base64.b64encode(page).decode()).rstrip("\n")


def _at_hand(model: Model) -> bool:
    return model.path is not None and any(model.path.glob("compliance-*.bin"))
