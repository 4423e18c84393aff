"""The material found from a bench test: modulus, law, held-out errors."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from palpate.diagnosis.specimen.result import FLOORS, Material
from palpate.mechanics.quantities import fitting_unit, quantity_words, split_key
from palpate.show.diagnosis.words import meaning as meaning_of
from palpate.show.page import Page, subplots
from palpate.show.quantities import readable, softness

if TYPE_CHECKING:
    from matplotlib.axes import Axes


def lines(result: Material) -> list[str]:
    """What `print` says, with units."""
    text = [f"{result.kind}: {result.curves} curve{'s' * (result.curves != 1)}; {_first(result)}"]
    if np.isfinite(result.young_modulus_pa):
        text.append(_modulus(result).replace(" of ", " ", 1))
    ranked = sorted(result.error.items(), key=lambda item: item[1])
    text.append(
        f"error on what no fit has seen ({result.held_out}): "
        + ", ".join(f"{n} {100 * e:.2g} %" for n, e in ranked)
    )
    if result.closed is not None and result.closed_ci95 is not None:
        closed, low, high = (min(share, 1.0) for share in (result.closed, *result.closed_ci95))
        text.append(
            f"what was found takes away {100 * closed:.0f} % of the gap (95 % sure: {100 * low:.0f} to "
            f"{100 * high:.0f} %)"
        )
    text += [f"  {_called(name)}: {in_words(name, v)}" for name, v in result.parameters.items()]
    text += [f"  {note}" for note in result.notes]
    if result.unknown:
        text.append(f"not told by such a test: {_unknown(result)}")
    return text


def _first(result: Material) -> str:
    """The verdict, after what makes it worth less."""
    doubts = []
    if result.beyond_constant:
        doubts.append(
            f"NO ANSWER: held-out errors of {100 * result.missed:.0f} % exceed the "
            f"{100 * result.error['constant']:.0f} % of a constant"
        )
    elif result.beaten_by is not None:
        doubts.append(f"{result.beaten_by} predicts held-out data better")
    if result.in_vain and not result.beyond_constant:
        doubts.append("the ideal model predicts held-out data better than with what was found")
    carried = ", which carries the modulus: NO ANSWER" if result.bound_carries else ""
    doubts += [f"{each} stands at the end of its range{carried}" for each in result.at_bound]
    return "; ".join([*doubts, result.verdict])


def in_words(name: str, value: Any) -> str:
    """A parameter, or those of an effect, as people write them: 'stiffness 68 N/mm'."""
    if isinstance(value, Mapping) and _fades(value):
        parts = zip(value["g"], value["tau_s"], strict=True)
        each = [f"{quantity_words('g', g)} fades in {quantity_words('tau_s', tau)}" for g, tau in parts]
        return f"of the lasting force {', '.join(each)}"
    if isinstance(value, Mapping):
        return ", ".join(
            f"{split_key(key)[0].replace('_', ' ')} {in_words(key, v)}" for key, v in value.items()
        )
    if isinstance(value, list | tuple):
        return ", ".join(in_words(name, v) for v in value) or "none"
    if isinstance(value, bool) or not isinstance(value, int | float):
        return str(value)
    return quantity_words(name, value)


def _fades(value: Mapping[str, Any]) -> bool:
    """Whether these are shares of a force, each with the time in which it fades."""
    shares, times = value.get("g"), value.get("tau_s")
    return isinstance(shares, list) and isinstance(times, list) and len(shares) == len(times) > 0


def report(result: Material, path: Path | str) -> Path:
    """Write one page; returns its path."""
    more = f" and {len(result.files) - _NAMED} more" if len(result.files) > _NAMED else ""
    page = Page(f"Material: {', '.join(Path(name).name for name in result.files[:_NAMED])}{more}")
    tell(result, page)
    page.result(as_json(result))
    return page.write(path)


def tell(result: Material, page: Page) -> None:
    """The answer, what it means, what to do; then how far it is off, and what was found, into a page."""
    page.lead(lead(result))
    page.paragraph(meaning(result))
    page.next_steps(next_steps(result))
    figure, ax = subplots(1, 1, figsize=(8, 4))
    draw(result, ax)
    first = f"{Path(result.files[0]).name} as it was measured, and {_by(result)} over it."
    page.figure(figure, first if result.seen else "Error of the best of each kind.")
    for name in result.effects:
        page.paragraph(
            f"{name.replace('_', ' ')[:1].upper()}{name.replace('_', ' ')[1:]}: {meaning_of(name)}."
        )
    page.heading("How far it is off")
    page.paragraph(
        f"Each way was fitted to the rest and predicts what was left out ({result.held_out}). A spring and "
        "damper is what one has without a theory of the material; a regression follows the curves without "
        "any mechanics, so little is left to gain beyond it."
    )
    ranked = sorted(result.error.items(), key=lambda item: item[1])
    page.table(["predicted by", "off by"], [[_way(n), f"{100 * e:.2g} %"] for n, e in ranked])
    if result.parameters:
        page.heading("What was found")
        rows = [[_called(name), in_words(name, v)] for name, v in result.parameters.items()]
        page.table(["what", "value"], rows)
    for note in result.notes:
        page.paragraph(f"{note[:1].upper()}{note[1:]}.")
    if result.unknown:
        page.paragraph(f"Such a test cannot tell: {_unknown(result)}.")


def lead(result: Material) -> str:
    """The answer in a sentence, after what makes it worth less."""
    first = _first(result)
    if not np.isfinite(result.young_modulus_pa):
        return f"{first[:1].upper()}{first[1:]}."
    said = f"The material has a {_modulus(result)}."
    if not result.predicts or result.at_bound or result.beaten_by:
        return f"{first[:1].upper()}{first[1:]}. {said}"
    return f"{said[:-1]}; {first}."


def _modulus(result: Material) -> str:
    low, high = result.young_modulus_ci95_pa
    unit, factor = ("Pa", 1.0)
    if result.young_modulus_pa >= _KILO:
        unit, factor = fitting_unit("young_modulus_pa", result.young_modulus_pa)
    sure = f" (95 % sure: {factor * low:.3g} to {factor * high:.3g} {unit})" if np.isfinite(low) else ""
    return f"Young's modulus of {factor * result.young_modulus_pa:.3g} {unit}{sure}"


def meaning(result: Material) -> str:
    """What the answer means."""
    if not result.predicts:
        return "What was left out is not predicted: do not use this answer."
    words = f"On what the fit had not seen it is {100 * result.missed:.2g} % off."
    if np.isfinite(result.young_modulus_pa):
        words = f"About as soft as {softness(result.young_modulus_pa)}. {words}"
    return words


def next_steps(result: Material) -> list[str]:
    """What to do with the answer."""
    if not result.predicts:
        return ["give more curves, or say what the files do not (`--tip-radius`, `--layer`, `--units`)"]
    if not np.isfinite(result.young_modulus_pa):
        return []
    modulus = float(f"{result.young_modulus_pa:.3g}")
    return [f"feel it in a shape of yours: `palpate touch SHAPE.stl --modulus {modulus:.0f}`"]


_NAMED = 3
_WAYS = {
    "verdict": "what was found",
    "verdict, holds": "what was found, of the holds alone",
    "ideal": "an ideal elastic material",
    "ideal, holds": "an ideal elastic material, of the holds alone",
    "on a rigid machine": "the best law on a machine that does not yield",
    "regression": "a regression, without mechanics",
    "constant": "one constant force",
    "kelvin-voigt": "a spring and damper (Kelvin–Voigt)",
    "hunt-crossley": "a spring and damper (Hunt–Crossley)",
    "spring": "a spring alone",
    "hertz": "Hertz's law of a ball",
    "sphere": "the law of a true ball",
    "linear": "a linear law",
    "neo-hookean": "the neo-Hookean law",
    "yeoh": "Yeoh's law, two terms",
    "yeoh-3": "Yeoh's law, three terms",
    "fung": "Fung's law",
    "ogden": "Ogden's law",
}
_KILO = 1e3


def _way(name: str) -> str:
    return _WAYS.get(name, name)


def _unknown(result: Material) -> str:
    return ", ".join(each.replace("_", " ") for each in result.unknown)


def _by(result: Material) -> str:
    """What the curve over the measured one is."""
    return "what was found" if result.effects and result.kind == "indentation" else _way(result.law)


def _called(name: str) -> str:
    """A parameter's name in words, without its unit."""
    return "first touch after" if name == "onset_m" else split_key(name)[0].replace("_", " ")


def as_json(result: Material) -> dict[str, Any]:
    """The figures of `palpate material --json`."""
    finite = np.isfinite(result.young_modulus_pa)
    return {
        "kind": result.kind,
        "files": list(result.files),
        "curves": result.curves,
        "held_out": result.held_out,
        "young_modulus_pa": result.young_modulus_pa if finite else None,
        "young_modulus_ci95_pa": (
            list(result.young_modulus_ci95_pa) if np.isfinite(result.young_modulus_ci95_pa).all() else None
        ),
        "law": result.law,
        "relative_error": result.error,
        "verdict": result.verdict,
        "effects": list(result.effects),
        "gap_closed": result.closed,
        "gap_closed_ci95": None if result.closed_ci95 is None else list(result.closed_ci95),
        "parameters": result.parameters,
        "notes": list(result.notes),
        "unknown": list(result.unknown),
        "predicts": result.predicts,
        "at_bound": list(result.at_bound),
        "bound_carries_modulus": result.bound_carries,
    }


def draw(result: Material, ax: Axes) -> None:
    """Measured and predicted, else the held-out errors."""
    if result.seen is None:
        own = "verdict" if "verdict" in result.error else result.law
        rivals = [n for n in FLOORS.get(result.kind, ()) if n in result.error]
        best = min(rivals, key=lambda n: result.error[n]) if rivals else own
        names = [n for n in dict.fromkeys(("constant", "regression", best, own)) if n in result.error]
        ax.barh([_way(n) for n in names], [100 * result.error[n] for n in names], color="#2a9d8f", height=0.6)
        ax.set(xlabel="error on what the fit has not seen [%]")
        ax.spines[["top", "right"]].set_visible(False)
        return
    x, measured, predicted, across, up = result.seen
    across, along = readable(across, [*x])
    up, both = readable(up, [*measured, *predicted])
    ax.plot(along, both[: len(measured)], ".", ms=4, color="#c1121f", label="measured")
    ax.plot(along, both[len(measured) :], "-", lw=1, color="#1d3557", label=_by(result))
    ax.set(xlabel=across, ylabel=up)
    ax.legend(frameon=False)
