"""What was opened: what it was taken for, then its result as that is shown."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

from palpate.importing.kinds import Opened
from palpate.show import steps_of, telling
from palpate.show.page import Page

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from pyvista import Plotter


def lines(result: Opened) -> list[str]:
    """What `print` says, line by line."""
    first, *more = result.result.lines()
    rest = [f"  {key}: {value}" for key, value in result.understood.items() if key != "took it for"]
    return [
        f"{', '.join(result.sources)}: taken for {result.understood['took it for']}; {first}",
        *rest,
        *(f"  {note}" for note in result.notes),
        *more,
    ]


def as_json(result: Opened) -> dict[str, Any]:
    """The figures of `palpate open --json`."""
    return {
        "kind": result.kind,
        "understood": {**result.understood, "notes": list(result.notes)},
        "odds": result.odds,
        "result": result.result.as_json(),
    }


def draw(result: Opened, ax: Axes) -> None:
    """The result's plot."""
    result.result.plot(ax)


def place(result: Opened, plotter: Plotter) -> None:
    """The result in space."""
    result.result.show(plotter)


def next_steps(result: Opened) -> list[str]:
    """What to do with what came of it."""
    return steps_of(result.result)


def report(result: Opened, path: Path | str) -> Path:
    """One page: the answer as its own page gives it, then what the file was taken for."""
    path = Path(path)
    path = path if path.suffix else path.with_suffix(".html")
    page = Page(f"Opened: {', '.join(result.sources)}")
    tell = telling(result.result)
    assert tell is not None, "what a file can become puts itself into a page"
    tell(result.result, page)
    page.heading("What the file was taken for")
    page.table(["what", "as"], [[key, value] for key, value in result.understood.items()])
    for note in result.notes:
        page.paragraph(f"{note[:1].upper()}{note[1:]}.")
    page.result(as_json(result))
    return page.write(path)
