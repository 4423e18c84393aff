"""What every result can do: a few lines of words with units, a plot by matplotlib, a scene by PyVista."""

from __future__ import annotations

import html
from abc import ABC, abstractmethod
from dataclasses import fields
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeVar

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from pyvista import Plotter

    from palpate.report.view3d import View

T = TypeVar("T")


class Result(ABC):
    """Base of the results. Two results are equal where they are the same one, as their arrays are large."""

    __eq__ = object.__eq__
    __hash__ = object.__hash__

    @abstractmethod
    def lines(self) -> list[str]:
        """What `print` says, line by line, with units."""

    @abstractmethod
    def _draw(self, ax: Axes) -> None:
        """The one plot of this result."""

    @abstractmethod
    def _place(self, plotter: Plotter) -> None:
        """Put this result into a 3D scene, device frame, m."""

    def view(self) -> View | None:
        """The object to be turned, as pages and notebooks show it; None where there is none."""
        return None

    def __str__(self) -> str:
        return "\n".join(self.lines())

    def __repr__(self) -> str:
        return str(self)

    def _repr_html_(self) -> str:
        """What a notebook shows: the words, and the plot under them."""
        import base64

        from matplotlib.figure import Figure

        from palpate.report.page import png_bytes

        figure = Figure(figsize=(7, 3.2), layout="constrained")
        self._draw(figure.subplots())
        picture = base64.b64encode(png_bytes(figure)).decode()
        return f'<pre>{html.escape(str(self))}</pre><img src="data:image/png;base64,{picture}">'

    def _in_cell(self) -> bool:
        """Show the view in a notebook's cell; whether there is one."""
        from matplotlib.figure import Figure

        from palpate.results.notebook import display, frame

        view = self.view()
        if view is not None:
            figure = Figure(figsize=(7, 3.2), layout="constrained")
            self._draw(figure.subplots())
            display(frame(view, self.lines()[0], figure))
        return view is not None

    def plot(self, ax: Axes | None = None) -> Axes:
        """Draw the result by matplotlib and return the axes, whose labels carry the units.

        ax: draw there; None makes a figure (`.figure.savefig("NAME.png")` writes it; in a script
        `matplotlib.pyplot.show()` opens it).
        """
        if ax is None:
            from matplotlib import pyplot

            _, ax = pyplot.subplots(figsize=(8, 4), layout="constrained")
        self._draw(ax)
        return ax

    def show(self, plotter: Plotter | None = None, *, screenshot: str | Path | None = None) -> Plotter | None:
        """Draw the result in 3D by PyVista (device frame, m) and return the plotter.

        plotter: add to it, and leave showing it to the caller. Without one a window opens; in a notebook the
        view of the pages, to be turned in the cell, where the result has one (then None is returned).
        screenshot: write this PNG instead, which needs no screen. Raises OptionError where there is no screen
        to show it on.
        """
        from mechanics.files import PNG, atomic_file
        from palpate.results.notebook import in_notebook
        from palpate.results.scenery import new_plotter

        if plotter is not None:
            self._place(plotter)
            return plotter
        if screenshot is None and in_notebook() and self._in_cell():
            return None
        plotter = new_plotter(off_screen=screenshot is not None)
        self._place(plotter)
        if screenshot is None:
            plotter.show()
        else:
            with atomic_file(screenshot, PNG) as temporary:
                plotter.screenshot(str(temporary))
        return plotter


def dressed(kind: type[T], plain: Any, **more: Any) -> T:
    """`plain`, a room's dataclass, as `kind`, the result made from it; itself where it is one already.

    more: fields that only the result has.
    """
    if isinstance(plain, kind) and not more:
        return plain
    made: Any = plain
    values = {f.name: getattr(made, f.name) for f in fields(made) if f.init}
    return kind(**{**values, **more})


def quantity(value: float, unit: str, scale: float = 1.0, digits: int = 4) -> str:
    """A number with its unit for people: `quantity(0.0123, "mm", 1e3)` is '12.3 mm'."""
    return f"{value * scale:.{digits}g} {unit}"


def triple(values: Any, scale: float = 1.0, digits: int = 4) -> str:
    """Three numbers as '(1, 2, 3)'."""
    return "(" + ", ".join(f"{float(v) * scale + 0.0:.{digits}g}" for v in values) + ")"
