"""A reconstruction: how the model came about, and the paper's figures and tables, remade."""

from __future__ import annotations

from typing import TYPE_CHECKING

from palpate.reconstruction.pipeline import Reconstruction
from palpate.show.reconstruction.exploration import force_over_time
from palpate.show.reconstruction.story import KEYS, story, view

if TYPE_CHECKING:
    from matplotlib.axes import Axes

__all__ = ["KEYS", "draw", "story", "view"]

SHOWN_AS = "model"


def draw(result: Reconstruction, ax: Axes) -> None:
    """Force over time with the touches that were found."""
    force_over_time(ax, result.exploration)
