"""What was opened: what it was taken for, then its result as that is shown."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

from mechanics.model import Model
from palpate.importing.opened import Opened
from palpate.show.page import Page, subplots

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from pyvista import Plotter


def lines(result: Opened) -> list[str]:
    """What `print` says, line by line."""
    rest = [f"  {key}: {value}" for key, value in result.understood.items() if key != "took it for"]
    return [
        f"{', '.join(result.sources)}: taken for {result.understood['took it for']}",
        *rest,
        *(f"  {note}" for note in result.notes),
        *result.result.lines(),
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


def report(result: Opened, path: Path | str) -> Path:
    """One page: what it was taken for, the answer in lines, its plot and the object to be turned."""
    path = Path(path)
    path = path if path.suffix else path.with_suffix(".html")
    page = Page(", ".join(result.sources))
    answer = result.result.lines()
    page.lead(answer[0])
    for line in answer[1:]:
        page.paragraph(line.strip())
    page.heading("What it was taken for")
    page.table(["what", "as"], [[key, value] for key, value in result.understood.items()])
    for note in result.notes:
        page.paragraph(note)
    figure, ax = subplots(1, 1, figsize=(8, 4))
    result.result.plot(ax)
    view = result.result.view()
    if view is None:
        page.figure(figure, "The result")
    else:
        held = result.result if isinstance(result.result, Model) else getattr(result.result, "model", None)
        page.view(view, figure, "The result", held)
    page.result(as_json(result))
    return page.write(path)
