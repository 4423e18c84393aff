"""How people read names, numbers and lists: the same words on a terminal, a page and in a message."""

from __future__ import annotations

import os
import re
import shlex
from collections.abc import Iterable, Sequence
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from palpate.mechanics.model.model import Model


def typed_word(text: object) -> str:
    """A path as a shell takes it: quoted where a space or a sign needs it."""
    word = str(text)
    if os.name == "posix":
        return shlex.quote(word)
    return f'"{word}"' if " " in word else word


def spaced(name: str) -> str:
    """A name of an effect or a key as people write it: 'time delay' of 'time_delay'."""
    return name.replace("_", " ")


def listed(words: Iterable[str], last: str = "and") -> str:
    """'a', 'a and b', 'a, b and c'; '' of none. last: 'and' or 'or'."""
    *first, end = list(words) or [""]
    return f"{', '.join(first)} {last} {end}" if first else end


def spoken(names: Iterable[str], last: str = "and") -> str:
    """Names of effects or keys as a list in a sentence."""
    return listed(map(spaced, names), last)


def begun(text: str) -> str:
    """With a capital letter first."""
    return text[:1].upper() + text[1:]


def small(text: str) -> str:
    """With a small letter first."""
    return text[:1].lower() + text[1:]


def ended(text: str) -> str:
    """With a full stop, where nothing ends it."""
    return text if text.endswith((".", "!", "?", ":")) else f"{text}."


def sentence(text: str) -> str:
    """A line as a whole sentence."""
    return ended(begun(text))


MOST_WORDS = 20
"""Of a headline."""
_BRACKETED = re.compile(r"^\(([^()]*)\)([.!?]?)$")
_FLAGGED = re.compile(r"\s*\(([^()]*--[^()]*)\)")


def headline(text: str) -> tuple[str, str]:
    """(what a headline says, what follows it in small type, or ''): at most 20 words, where the text has an
    end of a sentence or of a clause within them, and no flag of a command in brackets."""
    flags = _FLAGGED.findall(text)
    text = _FLAGGED.sub("", text)
    first, rest = text, ""
    if len(text.split()) > MOST_WORDS:
        for end in (r"(?<=[.!?])\s+", r";\s+", r"\s+(?=\()", r":\s+", r",\s+"):
            cuts = [found.span() for found in re.finditer(end, text)]
            if within := [(a, b) for a, b in cuts if 2 < len(text[:a].split()) <= MOST_WORDS]:
                first, rest = text[: within[-1][0]], text[within[-1][1] :]
                break
    rest = _BRACKETED.sub(r"\1\2", rest)
    return first, " ".join(filter(None, [rest and sentence(rest), *map(sentence, flags)]))


def counted(number: int, thing: str) -> str:
    """'1 curve', '3 curves'."""
    return f"{number} {thing}{'s' * (number != 1)}"


_FIGURE = re.compile(r"\d+(?:\.\d+)?")


def gathered(reasons: Iterable[str]) -> list[tuple[str, int]]:
    """Reasons that differ in figures alone as one, with their range, and how many there are; most first."""
    alike: dict[str, list[list[str]]] = {}
    for reason in reasons:
        alike.setdefault(_FIGURE.sub("{}", reason), []).append(_FIGURE.findall(reason))
    found = []
    for words, figures in alike.items():
        ends = [(min(each, key=float), max(each, key=float)) for each in zip(*figures, strict=True)]
        ranges = iter(low if low == high else f"{low} to {high}" for low, high in ends)
        found.append(
            ("".join(next(ranges) if w == "{}" else w for w in re.split(r"({})", words)), len(figures))
        )
    return sorted(found, key=lambda each: -each[1])


_RENDERERS = {
    "fem": "this model",
    "kelvin-voigt": "Kelvin–Voigt spring",
    "hunt-crossley": "Hunt–Crossley spring",
    "hunt-crossley-undamped": "Hunt–Crossley spring, no damper",
    "hunt-crossley-kh": "Hunt–Crossley spring, one power",
}


def renderer_words(name: str) -> str:
    """A renderer's one name on pages and in the window; another simulator's is its own."""
    return _RENDERERS.get(name, name)


def signed(words: str, value: Any) -> tuple[str, int]:
    """(words, 1), or where words say how late something is and the value is below 0, ('... early by', -1)."""
    early = isinstance(value, int | float) and value < 0 and " late " in f" {words} "
    return (words.replace("late", "early"), -1) if early else (words, 1)


def unsettled_words(unsettled: int, of: int) -> str:
    """Of forces that did not settle."""
    return f"{unsettled} of {counted(of, 'force')} did not settle: the one before was held"


def table_words(solved: float, error_n: float, depth_m: float) -> str:
    """How far a table is that is filled in while it is felt, and what it may be off by."""
    words = f"coarse table: {percent(solved)} of the places are solved"
    if error_n != error_n:
        return words
    return f"{words}; a press of {mm(depth_m)} is within {1e3 * error_n:.2g} mN (95 % of places)"


def with_unit(value: float, unit: str, scale: float = 1.0) -> str:
    """A number with its unit for people: `with_unit(0.0123, "mm", 1e3)` is '12.3 mm'."""
    return f"{value * scale:.4g} {unit}"


def mm(metres: float, form: str = ".3g") -> str:
    """A length in millimetres. form: of the number, as in a format string."""
    return f"{1e3 * metres:{form}} mm"


def mn(newtons: float, form: str = ".0f") -> str:
    """A force in millinewtons."""
    return f"{1e3 * newtons:{form}} mN"


_FEW_PA = 100.0
"""Below, a modulus is written in pascals: kilopascals would round it away."""


def kpa(pascals: float, form: str = ".2f") -> str:
    """A modulus in kilopascals, in pascals below 100. form: of kilopascals."""
    if 0 < abs(pascals) < _FEW_PA:
        return f"{pascals:{'+' * form.startswith('+')}.3g} Pa"
    return f"{pascals / 1e3:{form}} kPa"


def sure(low: object, high: object) -> str:
    """A 95 % interval, its ends as people read them."""
    return f"95 % sure: {low} to {high}"


def sure_kpa(ci95_pa: Sequence[float], form: str = ".2f") -> str:
    """The 95 % interval of a modulus, Pa; both ends in the unit that is said."""
    low, high = ci95_pa
    return sure(f"{low:.3g}" if 0 < high < _FEW_PA else f"{low / 1e3:{form}}", kpa(high, form))


def place_mm(point_m: Iterable[float]) -> str:
    """A place, m, as '(12, -3, 80) mm'."""
    return f"({', '.join(f'{1e3 * v:z.0f}' for v in point_m)}) mm"


def force_words(newtons: float) -> str:
    """A force in millinewtons, in newtons from one on."""
    return f"{newtons:.2f} N" if newtons >= 1 else mn(newtons)


def percent(share: float, form: str = ".0f") -> str:
    """A share as a percentage, which no line breaks."""
    return f"{100 * share:{form}}\u00a0%"


def estimate_words(share: float, low: float, high: float) -> tuple[str, str]:
    """A share and its interval: '88 %', '85 to 91 %', with a decimal where the ends would be one number."""
    form = ".0f" if round(100 * low) != round(100 * high) else ".1f"
    return percent(share, form), f"{100 * low:{form}} to {percent(high, form)}"


def chance_words(p: float) -> str:
    """A p value as one would say it."""
    if p < 0.0095:
        return "less than once in 100"
    if p < 0.995:
        return f"{100 * p:.0f} times in 100" if p >= 0.015 else "once in 100"
    return "always"


def share_words(value: float | None) -> str:
    """A share of the gap that is closed."""
    if value is None:
        return "-"
    return percent(value) if value >= 0 else "none (worse)"


def part_words(model: Model) -> str:
    """' of liver' where its global modulus is that of one part of a mesh's file, else ''."""
    part = model.provenance.get("modulus_of")
    return f" of {part}" if part else ""
