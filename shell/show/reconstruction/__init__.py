"""A reconstruction: how the model came about, and the paper's figures and tables, remade."""

from __future__ import annotations

from typing import TYPE_CHECKING

from palpate.reconstruction.pipeline import Reconstruction
from palpate.show import model as made
from palpate.show.reconstruction.exploration import force_over_time
from palpate.show.reconstruction.story import KEYS, story, view

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from pyvista import Plotter

__all__ = ["KEYS", "draw", "place", "story", "view"]


def draw(result: Reconstruction, ax: Axes) -> None:
    """Force over time with the touches that were found."""
    force_over_time(ax, result.exploration)


def place(result: Reconstruction, plotter: Plotter) -> None:
    """The model."""
    made.place(result.model, plotter)
