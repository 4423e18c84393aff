"""The base of everything that an operation returns: it prints, plots, shows and reports itself.

How that looks is said elsewhere: whoever draws registers itself here once (`present_by`), and every method
asks it. So this module, and every package whose types derive from `Result`, imports no plotting.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Mapping
from dataclasses import fields, is_dataclass
from operator import attrgetter
from pathlib import Path
from typing import Any, Protocol

import numpy as np

from palpate.mechanics.errors import OptionError

_PLAIN = (str, bool, int, float)


class Presenter(Protocol):
    """Says, draws and writes results of every type. Its methods do what those of `Result` of the same name
    state."""

    def lines(self, result: Result) -> list[str]: ...

    def as_json(self, result: Result) -> dict[str, Any]: ...

    def plot(self, result: Result, ax: Any) -> Any: ...

    def show(self, result: Result, plotter: Any, screenshot: str | Path | None) -> Any: ...

    def view(self, result: Result) -> Any: ...

    def report(self, result: Result, path: Path | str, **more: Any) -> Path: ...

    def save(self, result: Result, path: Path | str) -> Any: ...

    def html(self, result: Result) -> str: ...


_presenter: Presenter | None = None


def present_by(presenter: Presenter | None) -> None:
    """Let `presenter` say and draw every result from now on; None: nobody does."""
    global _presenter
    _presenter = presenter


class Result:
    """Base of the results, which are frozen dataclasses (`@dataclass(frozen=True, eq=False, repr=False)`).

    Without `eq` two results are equal where they are the same one, as their arrays are large; without `repr`
    they print as their lines.
    """

    def lines(self) -> list[str]:
        """What `print` says, line by line, with units."""
        return _plain_lines(self) if _presenter is None else _presenter.lines(self)

    def as_json(self) -> dict[str, Any]:
        """The figures as the command's `--json` gives them, keys with units."""
        return _presented(self).as_json(self)

    def plot(self, ax: Any = None) -> Any:
        """Draw the result by matplotlib and return the axes, whose labels carry the units.

        ax: draw there; None makes a figure (`.figure.savefig("NAME.png")` writes it; in a script
        `matplotlib.pyplot.show()` opens it).
        """
        return _presented(self).plot(self, ax)

    def show(self, plotter: Any = None, *, screenshot: str | Path | None = None) -> Any:
        """Draw the result in 3D by PyVista (device frame, m) and return the plotter.

        plotter: add to it, and leave showing it to the caller. Without one a window opens; in a notebook the
        view of the pages, to be turned in the cell, where the result has one (then None is returned).
        screenshot: write this PNG instead, which needs no screen. Raises OptionError where there is no screen
        to show it on.
        """
        return _presented(self).show(self, plotter, screenshot)

    def view(self) -> Any:
        """The object to be turned, as pages and notebooks show it; None where there is none."""
        return _presented(self).view(self)

    def save(self, path: Path | str) -> Any:
        """Write the result as the file or folder that reads it back: a MODEL, a recording, a curve.

        Returns the path; of a model the model that knows it. Raises OptionError where this kind of result is
        not written, FileError where something else is there.
        """
        return _presented(self).save(self, path)

    def report(self, path: Path | str) -> Path:
        """Write the result with pictures as one HTML page; returns its path.

        Raises OptionError where this kind of result has no page.
        """
        return self._report(path)

    def _report(self, path: Path | str, **more: Any) -> Path:
        """more: what the page of this kind of result takes beside."""
        return _presented(self).report(self, path, **more)

    def __str__(self) -> str:
        return "\n".join(self.lines())

    def __repr__(self) -> str:
        return str(self)

    def _repr_html_(self) -> str:
        """What a notebook shows: the words, the view of the pages where there is one, and the plot."""
        return _presented(self).html(self)


def _presented(result: Result) -> Presenter:
    if _presenter is None:
        raise OptionError(f"a {type(result).__name__} is drawn by palpate: `import palpate.show` first")
    return _presenter


def _plain_lines(result: Result) -> list[str]:
    """The class and its main numbers, which need nobody who knows more."""
    names: list[str] = [f.name for f in fields(result)] if is_dataclass(result) else []
    values = {name: getattr(result, name) for name in names}
    said = [f"{name} = {value}" for name, value in values.items() if isinstance(value, _PLAIN)]
    return [type(result).__name__ + (f": {', '.join(said)}" if said else "")]


def plain(value: Any) -> Any:
    """A value that JSON can hold: arrays as lists, numbers that are not finite as null; of a dataclass what
    its `as_json` gives, else its fields, each by the name in its metadata ("json") or its own."""
    if is_dataclass(value) and not isinstance(value, type):
        if hasattr(value, "as_json"):
            return plain(value.as_json())
        named = {f.metadata.get("json", f.name): getattr(value, f.name) for f in fields(value)}
        return plain(named)
    if isinstance(value, dict) or hasattr(value, "items"):
        return {str(k): plain(v) for k, v in value.items()}
    if isinstance(value, list | tuple | np.ndarray):
        return [plain(v) for v in value]
    if isinstance(value, np.generic):
        return plain(value.item())
    if isinstance(value, float) and not math.isfinite(value):
        return None
    return str(value) if isinstance(value, Path) else value


Key = str | tuple[str, Callable[[Any], Any]] | Callable[[Any], Mapping[str, Any]]
"""Of JSON: a field's name, 'key=path.of.fields', (key, function), or a function that gives several."""


def figures_of(result: Any, keys: Iterable[Key]) -> dict[str, Any]:
    """The JSON of a result."""
    found: dict[str, Any] = {}
    for key in keys:
        if isinstance(key, str):
            name, _, path = key.partition("=")
            found[name] = attrgetter(path or name)(result)
        elif isinstance(key, tuple):
            found[key[0]] = key[1](result)
        else:
            found |= key(result)
    return plain(found)
