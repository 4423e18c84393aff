"""The material found from a bench test: modulus, law, held-out errors."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from palpate.diagnosis.specimen.result import FLOORS, Material
from palpate.mechanics.quantities import fitting_unit, quantity_words, split_key
from palpate.show import story as say
from palpate.show.colours import COLOURS
from palpate.show.diagnosis.words import meaning as meaning_of
from palpate.show.page import drawn
from palpate.show.quantities import readable, softness
from palpate.words import counted, sentence, spaced, sure

if TYPE_CHECKING:
    from matplotlib.axes import Axes


def story(result: Material) -> say.Story:
    """The answer, what it means, what to do; how far it is off, and what was found."""
    more = f" and {len(result.files) - _NAMED} more" if len(result.files) > _NAMED else ""
    yield say.Title(f"Material: {', '.join(Path(name).name for name in result.files[:_NAMED])}{more}")
    yield say.Headline(f"{result.kind}: {counted(result.curves, 'curve')}; {_first(result)}", on=say.TEXT)
    yield say.Headline(lead(result), on=say.PAGE)
    if np.isfinite(result.young_modulus_pa):
        yield say.TextLine(_modulus(result).replace(" of ", " ", 1) + _given(result))
    yield say.Sentence(meaning(result), on=say.PAGE)
    yield say.Next(next_steps(result))
    first = f"{Path(result.files[0]).name} as it was measured, and {_by(result)} over it."
    yield say.Picture(
        lambda: drawn(draw, result, 8, 4), first if result.seen else "Error of the best of each kind."
    )
    yield from (say.Sentence(f"{spaced(name)}: {meaning_of(name)}", on=say.PAGE) for name in result.effects)
    ranked = sorted(result.error.items(), key=lambda item: item[1])
    errors = ", ".join(f"{n} {100 * e:.2g} %" for n, e in ranked)
    yield say.TextLine(f"error on held-out data ({result.held_out}): {errors}")
    if result.closed is not None and result.closed_ci95 is not None:
        closed, low, high = (100 * min(share, 1.0) for share in (result.closed, *result.closed_ci95))
        interval = sure(f"{low:.0f}", f"{high:.0f} %")
        yield say.TextLine(f"what was found explains {closed:.0f} % of the gap ({interval})")
    yield say.Section("How far is it off?", [
        say.Sentence(
            f"Each way was fitted to the rest and predicts what was left out ({result.held_out}). A spring "
            "and damper is what one has without a theory of the material; a regression follows the curves "
            "without any mechanics, so little can be gained beyond it."
        ),
        say.Rows(["predicted by", "off by"], [[_way(n), f"{100 * e:.2g} %"] for n, e in ranked]),
    ])  # fmt: skip
    rows = [[_called(name), in_words(name, v)] for name, v in result.parameters.items()]
    yield from (say.Detail(f"{what}: {value}", on=say.TEXT) for what, value in rows)
    if rows:
        yield say.Section("What was found?", [say.Rows(["what", "value"], rows)])
    yield from map(say.Note, result.notes)
    if result.unknown:
        unknown = ", ".join(map(spaced, result.unknown))
        yield say.TextLine(f"such a test cannot determine: {unknown}")
        yield say.Sentence(f"Such a test cannot determine: {unknown}", on=say.PAGE)


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
        return ", ".join(f"{spaced(split_key(key)[0])} {in_words(key, v)}" for key, v in value.items())
    if isinstance(value, list | tuple):
        return ", ".join(in_words(name, v) for v in value) or "none"
    if isinstance(value, bool) or not isinstance(value, int | float):
        return str(value)
    return quantity_words(name, value)


def _fades(value: Mapping[str, Any]) -> bool:
    """Whether these are shares of a force, each with the time in which it fades."""
    shares, times = value.get("g"), value.get("tau_s")
    return isinstance(shares, list) and isinstance(times, list) and len(shares) == len(times) > 0


def lead(result: Material) -> str:
    """The answer in a sentence, after what makes it worth less."""
    first = _first(result)
    if not np.isfinite(result.young_modulus_pa):
        return sentence(first)
    said = f"The material has a {_modulus(result)}{_given(result)}."
    if not result.predicts or result.at_bound or result.beaten_by:
        return f"{sentence(first)} {said}"
    return f"{said[:-1]}; {first}."


def _given(result: Material) -> str:
    """What the modulus goes with: ', of a sphere ..., for Poisson's ratio 0.49 (nobody stated it)'."""
    if result.tip is None:
        return ""
    who = {
        "stated": "as stated",
        "file": "as the file says",
        "assumed": "assumed: --poisson-ratio sets another",
    }
    ratio = f"{result.poisson_ratio:.3g} ({who[result.poisson_from]})"
    return f", under {result.tip.words}, for Poisson's ratio {ratio}"


def _modulus(result: Material) -> str:
    low, high = result.young_modulus_ci95_pa
    unit, factor = ("Pa", 1.0)
    if result.young_modulus_pa >= _KILO:
        unit, factor = fitting_unit("young_modulus_pa", result.young_modulus_pa)
    ends = sure(f"{factor * low:.3g}", f"{factor * high:.3g} {unit}")
    interval = f" ({ends})" if np.isfinite(low) else ""
    return f"Young's modulus of {factor * result.young_modulus_pa:.3g} {unit}{interval}"


def meaning(result: Material) -> str:
    """What the answer means."""
    if not result.predicts:
        return "The held-out data are not predicted: do not use this answer."
    words = f"On held-out data it is {100 * result.missed:.2g} % off."
    if np.isfinite(result.young_modulus_pa):
        words = f"About as soft as {softness(result.young_modulus_pa)}. {words}"
    return words


def next_steps(result: Material) -> list[str]:
    """What to do with the answer."""
    if not result.predicts:
        return [
            "give more curves, or say what the files do not (`--tip`, `--tip-radius`, `--layer`, `--units`)"
        ]
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
    "kelvin-voigt": "a Kelvin–Voigt spring",
    "hunt-crossley": "a Hunt–Crossley spring",
    "spring": "a spring alone",
    "hertz": "Hertz's law of a ball",
    "sphere": "the law of a true ball",
    "punch": "the law of a flat punch",
    "cone": "the law of a cone",
    "pyramid": "the law of a pyramid",
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


def _by(result: Material) -> str:
    """What the curve over the measured one is."""
    return "what was found" if result.effects and result.kind == "indentation" else _way(result.law)


def _called(name: str) -> str:
    """A parameter's name in words, without its unit."""
    return "first touch after" if name == "onset_m" else spaced(split_key(name)[0])


def _finite(values: Any) -> Any:
    """What is known; None where an end of it is not."""
    return values if np.isfinite(values).all() else None


KEYS: tuple[say.Key, ...] = (
    "kind",
    "files",
    "curves",
    "held_out",
    "young_modulus_pa",
    ("young_modulus_ci95_pa", lambda result: _finite(result.young_modulus_ci95_pa)),
    "law",
    "relative_error=error",
    "verdict",
    "effects",
    "gap_closed=closed",
    "gap_closed_ci95=closed_ci95",
    "parameters",
    "notes",
    "unknown",
    "predicts",
    ("poisson_ratio", lambda result: _finite(result.poisson_ratio)),
    "poisson_from",
    ("tip", lambda result: result.tip and result.tip.form),
    "at_bound",
    "bound_carries_modulus=bound_carries",
)


def draw(result: Material, ax: Axes) -> None:
    """Measured and predicted, else the held-out errors."""
    if result.seen is None:
        own = "verdict" if "verdict" in result.error else result.law
        rivals = [n for n in FLOORS.get(result.kind, ()) if n in result.error]
        best = min(rivals, key=lambda n: result.error[n]) if rivals else own
        names = [n for n in dict.fromkeys(("constant", "regression", best, own)) if n in result.error]
        ax.barh(
            [_way(n) for n in names],
            [100 * result.error[n] for n in names],
            color=COLOURS["found"],
            height=0.6,
        )
        ax.set(xlabel="error on held-out data [%]")
        ax.spines[["top", "right"]].set_visible(False)
        return
    x, measured, predicted, across, up = result.seen
    across, along = readable(across, [*x])
    up, both = readable(up, [*measured, *predicted])
    ax.plot(along, both[: len(measured)], ".", ms=4, color=COLOURS["measured"], label="measured")
    ax.plot(along, both[len(measured) :], "-", lw=1, color=COLOURS["fem"], label=_by(result))
    ax.set(xlabel=across, ylabel=up)
    ax.legend(frameon=False)
