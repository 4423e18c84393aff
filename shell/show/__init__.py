"""How results look: in lines, as a plot (matplotlib), in 3D (PyVista), as an HTML page; one module a kind.

A module has those of these that its result needs:

    story(result, **more) -> blocks        what it has to say, once (`show.story`), for terminal and page;
                                           first the page's Title, where there is a page
    KEYS                                   of the command's --json (`story.Key`)
    draw(result, ax)                       the one plot
    place(result, plotter)                 into a 3D scene, device frame, m
    SHOWN_AS                               the attribute that is drawn and placed where these are absent
    view(result) -> View | None            the object to be turned, in pages and notebooks
    save(result, path)                     what reads it back, where its own class does not write it

`register(TYPE, module)` adds one. Importing this package lets every result know; a module is imported when a
result of its type is first printed or drawn, matplotlib and PyVista when one is first drawn.
"""

from __future__ import annotations

import importlib
from pathlib import Path
from types import ModuleType
from typing import TYPE_CHECKING, Any

from palpate.child import loaded_whole
from palpate.mechanics.errors import OptionError
from palpate.mechanics.result import Result, present_by
from palpate.show.story import Story, Title, figures_of, lines_of, steps_of

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure
    from pyvista import Plotter

    from palpate.show.view3d import View

_KINDS: dict[str, str | ModuleType] = {
    "palpate.mechanics.recording.recording.Recording": "recording",
    "palpate.mechanics.model.model.Model": "model",
    "palpate.mechanics.recording.calibration.Calibration": "calibration",
    "palpate.reconstruction.pipeline.Reconstruction": "reconstruction",
    "palpate.reconstruction.checks.finding.Checkup": "check",
    "palpate.render.press.Curve": "curve",
    "palpate.render.replay.ReplayResult": "replay",
    "palpate.diagnosis.compare.comparison.Comparison": "comparison",
    "palpate.diagnosis.compare.before_after.Changes": "changes",
    "palpate.diagnosis.verdict.result.Diagnosis": "diagnosis",
    "palpate.diagnosis.other_simulator.result.SimulatedGap": "other_simulator",
    "palpate.diagnosis.other_simulator.tuned.Tuned": "tuned",
    "palpate.diagnosis.explore.suggestion.Explored": "exploration",
    "palpate.diagnosis.specimen.result.Material": "material",
    "palpate.scenes.laboratory.simulate.Simulation": "simulation",
    "palpate.importing.imported.Imported": "imported",
    "palpate.importing.kinds.Opened": "opened",
    "palpate.batching.summary.Batch": "batch",
    "palpate.demo.DemoResult": "demo",
}
"""Type -> the module of this package that shows it."""


def register(kind: type[Result], module: ModuleType) -> None:
    """Let `module` show results of a type and of those derived from it."""
    _KINDS[_name(kind)] = module


def _name(kind: type) -> str:
    return f"{kind.__module__}.{kind.__qualname__}"


def _module_of(result: Result) -> ModuleType:
    for kind in type(result).__mro__:
        found = _KINDS.get(_name(kind))
        if isinstance(found, str):
            found = _KINDS[_name(kind)] = _loaded(f"{__name__}.{found}")
        if found is not None:
            return found
    name = type(result).__name__
    raise OptionError(f"no module shows a {name}: palpate.show.register({name}, module) names one")


def _loaded(name: str) -> ModuleType:
    with loaded_whole():
        return importlib.import_module(name)


def _function(result: Result, name: str, words: str) -> Any:
    module = _module_of(result)
    if (found := getattr(module, name, None)) is not None:
        return found
    if name in ("draw", "place") and (part := getattr(module, "SHOWN_AS", "")):
        shown = getattr(result, part)
        return lambda _, canvas: _function(shown, name, words)(shown, canvas)
    raise OptionError(f"a {type(result).__name__} has no {words}")


def story_of(result: Result, **more: Any) -> Story:
    """What a result has to say. more: what its kind's `story` takes beside."""
    return _function(result, "story", "words")(result, **more)


def next_lines(result: Result, **more: Any) -> list[str]:
    """What a terminal says last: what to do with a result, a step a line, and commands that follow one
    another a line each; nothing where its story says none. more: what its kind's `story` takes beside."""
    steps = steps_of(story_of(result, **more)) if _has_story(result) else []
    lines = []
    for step in steps:
        words, _, commands = step.partition("`") if _THEN in step else (step, "", "")
        lines += [words.rstrip(), *(f"  {each}" for each in commands.split(_THEN) if each)]
    return [f"{'next:' if k == 0 else '     '} {line.replace('`', '')}" for k, line in enumerate(lines)]


_THEN = "`, `"
"""Between two commands of a step."""


def _has_story(result: Result) -> bool:
    try:
        return hasattr(_module_of(result), "story")
    except OptionError:  # it says its own lines
        return False


class _Presenter:
    """Asks the module of a result's type (`mechanics.result.Presenter`)."""

    def lines(self, result: Result) -> list[str]:
        return lines_of(story_of(result))

    def as_json(self, result: Result) -> dict[str, Any]:
        return figures_of(result, _function(result, "KEYS", "figures for JSON"))

    def plot(self, result: Result, ax: Axes | None) -> Axes:
        draw = _function(result, "draw", "plot")
        if ax is None:
            _, ax = _loaded("matplotlib.pyplot").subplots(figsize=(8, 4), layout="constrained")
        draw(result, ax)
        return ax

    def show(self, result: Result, plotter: Plotter | None, screenshot: str | Path | None) -> Plotter | None:
        from palpate.mechanics.disk.writing import PNG, atomic_file
        from palpate.show.notebook import in_notebook, show_view
        from palpate.show.scenery import new_plotter

        place = _function(result, "place", "place in space: use .plot()")
        _loaded("pyvista")
        if plotter is not None:
            place(result, plotter)
            return plotter
        view = self.view(result) if screenshot is None and in_notebook() else None
        if view is not None:
            show_view(view, result.lines()[0])
            return None
        plotter = new_plotter(off_screen=screenshot is not None)
        place(result, plotter)
        if screenshot is None:
            plotter.show()
        else:
            with atomic_file(screenshot, PNG) as temporary:
                plotter.screenshot(str(temporary))
        return plotter

    def view(self, result: Result) -> View | None:
        found = getattr(_module_of(result), "view", None)
        return None if found is None else found(result)

    def report(self, result: Result, path: Path | str, **more: Any) -> Path:
        from palpate.show.page import page_of

        story = iter(_function(result, "story", "page")(result, **more))
        title = next(story, None)
        if not isinstance(title, Title):
            raise OptionError(f"a {type(result).__name__} has no page")
        _loaded("matplotlib.backends.backend_agg")
        return page_of(title, story, result.as_json(), path)

    def save(self, result: Result, path: Path | str) -> Any:
        return _function(result, "save", "file of its own")(result, path)

    def html(self, result: Result) -> str:
        from palpate.show.notebook import cell

        return cell(str(result), self.view(result), self._picture(result))

    def _picture(self, result: Result) -> Figure:
        from palpate.show.page import new_figure

        _loaded("matplotlib.backends.backend_agg")
        figure = new_figure(7, 3.2, layout="constrained")
        _function(result, "draw", "plot")(result, figure.subplots())
        return figure


present_by(_Presenter())
