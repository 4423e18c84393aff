"""Two recordings of one object: what differs, and what explains it."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from palpate.diagnosis.compare.before_after import Changes, Side
from palpate.show.diagnosis.words import verdict
from palpate.show.model import thing_of, usual_colourings
from palpate.show.page import Page, file_words, new_figure
from palpate.show.quantities import ShownQuantity
from palpate.show.scenery import add_dots, add_object
from palpate.show.view3d import Colouring, View

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from pyvista import Plotter

_COLOURS = ("#1d3557", "#c1121f")
_RATIO = ShownQuantity("second over first modulus", "", 1.0, "coolwarm", least_share=0.2)


def lines(result: Changes) -> list[str]:
    """What `print` says, with units."""
    text = [result.summary]
    for side, words in ((result.before, "first"), (result.after, "second")):
        low, high = side.model.material.young_modulus_ci95_pa
        named = f"; {verdict(side.diagnosis)}" if side.diagnosis is not None else ""
        text.append(
            f"{words}, {side.recording.name}: {side.modulus_pa / 1e3:.2f} kPa (95 % sure: "
            f"{low / 1e3:.2f} to {high / 1e3:.2f} kPa){named}"
        )
    low, high = result.difference_ci95_pa
    text.append(
        f"difference {result.difference_pa / 1e3:+.2f} kPa (95 % sure: {low / 1e3:+.2f} to {high / 1e3:+.2f})"
    )
    if result.places:
        apart = [p for p in result.places if not p.ci95[0] <= 1 <= p.ci95[1]]
        ratios = np.array([p.ratio for p in result.places])
        text.append(
            f"{len(result.places)} places that both pressed: ratio {ratios.min():.2f} to "
            f"{ratios.max():.2f}, {len(apart)} of them beyond their interval"
        )
    return [*text, *(f"  {reason}" for reason in result.reasons)]


def as_json(result: Changes) -> dict[str, Any]:
    """The figures of `palpate compare REC REC2 --json`."""

    def side(each: Side) -> dict[str, Any]:
        verdict = None
        if each.diagnosis is not None:
            d = each.diagnosis
            verdict = {"kind": d.kind, "effects": list(d.effects), "candidates": list(d.candidates)}
        return {
            "recording": each.recording.name,
            "young_modulus_pa": each.modulus_pa,
            "young_modulus_ci95_pa": list(each.model.material.young_modulus_ci95_pa),
            "beside_effects_pa": each.beside_effects_pa,
            "verdict": verdict,
        }

    return {
        "before": side(result.before),
        "after": side(result.after),
        "ratio": result.ratio,
        "ratio_ci95": list(result.ratio_ci95),
        "difference_pa": result.difference_pa,
        "difference_ci95_pa": list(result.difference_ci95_pa),
        "differs": result.differs,
        "ratio_beside_effects": None if result.beside is None else result.beside[0],
        "ratio_beside_effects_ci95": None if result.beside is None else list(result.beside[1]),
        "places": [
            {
                **dict(zip("xyz", map(float, p.point), strict=True)),
                "ratio": p.ratio,
                "ratio_ci95": list(p.ci95),
            }
            for p in result.places
        ],
        "explained_by": list(result.explained_by),
        "shifted": result.shifted,
        "reasons": list(result.reasons),
    }


def place(result: Changes, plotter: Plotter) -> None:
    """The first object, coloured at shared places by the ratio."""
    add_object(plotter, result.before.model)
    if result.places:
        points = np.array([p.point for p in result.places])
        add_dots(
            plotter, points, np.array([p.ratio for p in result.places]), label="ratio", colour_map="coolwarm"
        )


def report(result: Changes, path: Path | str) -> Path:
    """One self-contained page; returns its path."""
    page = Page(f"Before and after: {result.before.recording.name} and {result.after.recording.name}")
    page.lead(result.summary[:1].upper() + result.summary[1:] + ".")
    low, high = (100 * (r - 1) for r in result.ratio_ci95)
    named = [n.replace("young_modulus", "Young's modulus").replace("_", " ") for n in result.explained_by]
    cause, beside = "not asked", "a diagnosis of both would tell"
    if result.before.diagnosis is not None:
        cause, beside = " and ".join(named) or "nothing", ""
    if result.beside is not None:
        left = 100 * (result.beside[0] - 1)
        beside = f"with the effects of both taken in, the moduli differ by {left:+.0f} %"
    page.next_steps(next_steps(result))
    page.cards([
        ("Do they differ?", "yes" if result.differs else "not beyond their intervals",
         f"second modulus less the first: {100 * (result.ratio - 1):+.0f} % (95 % sure: {low:+.0f} to "
         f"{high:+.0f} %)"),
        ("What explains it?", cause, beside),
        ("Where?", f"{len(result.places)} shared places" if result.places else "no shared places",
         "places within 12 mm of one another, each with its own ratio" if result.places
         else "the two recordings share too few places, or no frame"),
    ])  # fmt: skip
    figure = new_figure(8, 3.4)
    draw(result, figure.subplots())
    page.view(
        view(result),
        figure,
        "The ratio at every place that both pressed." if result.places else "Moduli, 95 % sure.",
        result.before.model,
    )
    rows = []
    for side in (result.before, result.after):
        interval = side.model.material.young_modulus_ci95_pa
        said = verdict(side.diagnosis) if side.diagnosis is not None else "not diagnosed"
        kilo = (v / 1e3 for v in (side.modulus_pa, *interval, side.beside_effects_pa))
        rows.append([side.recording.name, *kilo, said])
    page.heading("Both by themselves")
    heads = ["recording", "modulus [kPa]", "95 % sure: from", "to", "with its effects [kPa]", "verdict"]
    page.table(heads, rows)
    for reason in result.reasons:
        page.paragraph(reason[:1].upper() + reason[1:] + ".")
    page.figure(
        figure,
        "The ratio at every place that both pressed, 95 % sure within the bars."
        if result.places
        else "Both moduli, 95 % sure within the bars.",
    )
    page.result(as_json(result))
    return page.write(path)


def view(result: Changes) -> View:
    """The first's object, coloured by the ratio at places that both pressed, else by its own moduli."""
    model = result.before.model
    if not result.places:
        return View(thing_of(model), model.presses.point, usual_colourings(model))
    ratios = np.array([place.ratio for place in result.places])
    ratio = Colouring(_RATIO, None, ratios, "At places that both pressed; in between what is near.")
    return View(thing_of(model), np.array([place.point for place in result.places]), [ratio])


def next_steps(result: Changes) -> list[str]:
    """What to do with the answer."""
    first = file_words(result.before.recording.path, "REC")
    second = file_words(result.after.recording.path, "REC2")
    if result.before.diagnosis is None:
        return [f"ask what explains it: `palpate compare {first} {second}` without --no-diagnosis"]
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
        ax.errorbar(x, ratio, np.abs(ends.T - ratio), fmt="o", ms=4, color=_COLOURS[0], label="at a place")
        ax.axhspan(*result.ratio_ci95, color=_COLOURS[1], alpha=0.2, label="of the whole")
        ax.axhline(1.0, color="0.5", lw=1, ls="--")
        ax.set(xlabel="place, sorted", ylabel="second over first modulus")
        ax.legend(frameon=False, fontsize=8, ncol=2, loc="lower right", bbox_to_anchor=(1.0, 1.0))
        return
    for k, side in enumerate((result.before, result.after)):
        value = side.modulus_pa / 1e3
        low, high = (v / 1e3 for v in side.model.material.young_modulus_ci95_pa)
        ax.errorbar([k], [value], [[value - low], [high - value]], fmt="o", color=_COLOURS[k], capsize=4)
    ax.set_xticks([0, 1], [result.before.recording.name, result.after.recording.name])
    ax.set(ylabel="Young's modulus [kPa]", xlim=(-0.5, 1.5))
