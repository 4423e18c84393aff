"""Two recordings of one object: what differs, and what explains it."""

from __future__ import annotations

from functools import cache
from typing import TYPE_CHECKING

import numpy as np

from palpate.diagnosis.compare.before_after import Changes
from palpate.show import story as say
from palpate.show.colours import COLOURS
from palpate.show.diagnosis.words import verdict
from palpate.show.model import thing_of, usual_colourings
from palpate.show.page import drawn, file_words
from palpate.show.quantities import ShownQuantity
from palpate.show.scenery import add_dots, add_object
from palpate.show.view3d import Colouring, View
from palpate.words import begun, kpa, listed, spaced, sure, sure_kpa

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from pyvista import Plotter

_RATIO = ShownQuantity("second over first modulus", "", 1.0, "coolwarm", least_share=0.2)


def story(result: Changes) -> say.Story:
    """What differs, and what explains it."""
    yield say.Title(f"Before and after: {result.before.recording.name} and {result.after.recording.name}")
    yield say.Headline(result.summary, on=say.TEXT)
    yield say.Headline(begun(result.summary), on=say.PAGE)
    yield say.Next(_next_steps(result))
    yield from _moduli(result)
    if result.places:
        apart = [p for p in result.places if not p.ci95[0] <= 1 <= p.ci95[1]]
        ratios = np.array([p.ratio for p in result.places])
        yield say.TextLine(
            f"{len(result.places)} places that both pressed: ratio {ratios.min():.2f} to "
            f"{ratios.max():.2f}, {len(apart)} of them beyond their interval"
        )
    yield say.Cards(_cards(result))
    picture = cache(lambda: drawn(draw, result, 8, 3.4, layout=None))
    ratio = "The ratio at every place that both pressed"
    yield say.Turned(
        lambda: view(result),
        say.Picture(picture, f"{ratio}." if result.places else "Moduli, 95 % sure."),
        result.before.model,
    )
    yield say.Section("What is each by itself?", _both(result))
    yield from map(say.Note, result.reasons)
    bars = ratio if result.places else "Both moduli"
    yield say.Picture(picture, f"{bars}, 95 % sure within the bars.")


def _moduli(result: Changes) -> say.Story:
    for side, words in ((result.before, "first"), (result.after, "second")):
        interval = sure_kpa(side.model.material.young_modulus_ci95_pa)
        named = f"; {verdict(side.diagnosis)}" if side.diagnosis is not None else ""
        yield say.TextLine(f"{words}, {side.recording.name}: {kpa(side.modulus_pa)} ({interval}){named}")
    low, high = result.difference_ci95_pa
    interval = sure(kpa(low, "+.2f"), kpa(high, "+.2f"))
    yield say.TextLine(f"difference {kpa(result.difference_pa, '+.2f')} ({interval})")


def _cards(result: Changes) -> list[tuple[str, str, str]]:
    low, high = (100 * (r - 1) for r in result.ratio_ci95)
    cause, beside = "not diagnosed", "a diagnosis of both would show it"
    if result.before.diagnosis is not None:
        named = [spaced(n.replace("young_modulus", "Young's modulus")) for n in result.explained_by]
        cause, beside = listed(named) or "nothing", ""
    if result.beside is not None:
        left = 100 * (result.beside[0] - 1)
        beside = f"with the effects of both taken into account, the moduli differ by {left:+z.0f} %"
    there = ("no shared places", "the two recordings share too few places, or no frame")
    if result.places:
        there = (
            f"{len(result.places)} shared places",
            "places within 12 mm of one another, each with its own ratio",
        )
    differ = "yes" if result.differs else "not beyond their intervals"
    interval = sure(f"{low:+z.0f}", f"{high:+z.0f} %")
    size = f"second modulus less the first: {100 * (result.ratio - 1):+z.0f} % ({interval})"
    return [
        ("Do they differ?", differ, size),
        ("What explains it?", cause, beside),
        ("Where?", *there),
    ]


def _both(result: Changes) -> say.Story:
    rows = []
    for side in (result.before, result.after):
        interval = side.model.material.young_modulus_ci95_pa
        said = verdict(side.diagnosis) if side.diagnosis is not None else "not diagnosed"
        kilo = (v / 1e3 for v in (side.modulus_pa, *interval, side.beside_effects_pa))
        rows.append([side.recording.name, *kilo, said])
    heads = ["recording", "modulus [kPa]", "95 % sure: from", "to", "with its effects [kPa]", "verdict"]
    yield say.Rows(heads, rows)


_VERDICT: tuple[say.Key, ...] = ("kind", "effects", "candidates")
_SIDE: tuple[say.Key, ...] = (
    "recording=recording.name",
    "young_modulus_pa=modulus_pa",
    "young_modulus_ci95_pa=model.material.young_modulus_ci95_pa",
    "beside_effects_pa",
    ("verdict", lambda side: None if side.diagnosis is None else say.figures_of(side.diagnosis, _VERDICT)),
)
_PLACE: tuple[say.Key, ...] = (
    lambda place: dict(zip("xyz", place.point, strict=True)),
    "ratio",
    "ratio_ci95=ci95",
)
KEYS: tuple[say.Key, ...] = (
    ("before", lambda result: say.figures_of(result.before, _SIDE)),
    ("after", lambda result: say.figures_of(result.after, _SIDE)),
    "ratio",
    "ratio_ci95",
    "difference_pa",
    "difference_ci95_pa",
    "differs",
    ("ratio_beside_effects", lambda result: None if result.beside is None else result.beside[0]),
    ("ratio_beside_effects_ci95", lambda result: None if result.beside is None else result.beside[1]),
    ("places", lambda result: [say.figures_of(place, _PLACE) for place in result.places]),
    "explained_by",
    "shifted",
    "reasons",
)


def place(result: Changes, plotter: Plotter) -> None:
    """The first object, coloured at shared places by the ratio."""
    add_object(plotter, result.before.model)
    if result.places:
        points = np.array([p.point for p in result.places])
        add_dots(
            plotter, points, np.array([p.ratio for p in result.places]), label="ratio", colour_map="coolwarm"
        )


def view(result: Changes) -> View:
    """The first's object, coloured by the ratio at places that both pressed, else by its own moduli."""
    model = result.before.model
    if not result.places:
        return View(thing_of(model), model.presses.point, usual_colourings(model))
    ratios = np.array([place.ratio for place in result.places])
    ratio = Colouring(_RATIO, None, ratios, "At places that both pressed; in between what is near.")
    return View(thing_of(model), np.array([place.point for place in result.places]), [ratio])


def _next_steps(result: Changes) -> list[str]:
    first = file_words(result.before.recording.path, "REC")
    second = file_words(result.after.recording.path, "REC2")
    if result.before.diagnosis is None:
        return [f"find what explains it: `palpate compare {first} {second}` without --no-diagnosis"]
    if result.explained_by:
        return [f"see the evidence: `palpate diagnose {second} --report PAGE.html`"]
    return [
        f"make a model of each, and feel it: `palpate reconstruct {first} -o MODEL`, `palpate touch MODEL`"
    ]


def draw(result: Changes, ax: Axes) -> None:
    """Both moduli over one another where no place is shared, else each place's ratio."""
    if result.places:
        order = np.argsort([p.ratio for p in result.places])
        ratio = np.array([result.places[i].ratio for i in order])
        ends = np.array([result.places[i].ci95 for i in order])
        x = np.arange(len(ratio))
        ax.errorbar(
            x, ratio, np.abs(ends.T - ratio), fmt="o", ms=4, color=COLOURS["press"], label="at a place"
        )
        ax.axhspan(*result.ratio_ci95, color=COLOURS["interval"], label="of the whole")
        ax.axhline(1.0, color=COLOURS["reference"], lw=1, ls="--")
        ax.set(xlabel="place, sorted", ylabel="second over first modulus")
        ax.legend(frameon=False, fontsize=8, ncol=2, loc="lower right", bbox_to_anchor=(1.0, 1.0))
        return
    for k, side in enumerate((result.before, result.after)):
        value = side.modulus_pa / 1e3
        low, high = (v / 1e3 for v in side.model.material.young_modulus_ci95_pa)
        ax.errorbar(
            [k],
            [value],
            [[value - low], [high - value]],
            fmt="o",
            color=COLOURS[("first", "second")[k]],
            capsize=4,
        )
    ax.set_xticks([0, 1], [result.before.recording.name, result.after.recording.name])
    ax.set(ylabel="Young's modulus [kPa]", xlim=(-0.5, 1.5))
