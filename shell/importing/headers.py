"""What the text around a machine's numbers, or the description beside a recording's samples, states: the tip,
Poisson's ratio, the maker's own modulus."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, TypeVar

from palpate.importing.formats.registry import SHEET_SUFFIXES, TEXT_SUFFIXES
from palpate.importing.formats.sheets import lines_of
from palpate.importing.formats.text import decoded
from palpate.importing.tables import SI
from palpate.mechanics.disk.reading import read_toml
from palpate.mechanics.disk.schema import check_table
from palpate.mechanics.errors import RecordingError
from palpate.mechanics.plausible import POISSON_RATIO
from palpate.mechanics.quantities import parse_unit
from palpate.mechanics.recording.files import SCHEMA, description_of

T = TypeVar("T")
_HEAD_ROWS, _HEAD_BYTES = 60, 8000
_NUMBER = r"(\d+(?:[.,]\d+)?(?:[eE][-+]?\d+)?)"
_RADIUS = re.compile(
    r"\b(?:probe|tip|indenter|sphere|ball|bead|punch)\b[^\n]{0,20}?\b(radius|diameter)\b[^\n\d]{0,12}?"
    r"(?:[\[(]\s*(m|mm|um|µm|nm)\s*[\])])?\s*[:=,;\t ]*\s*" + _NUMBER.replace("[eE][-+]?", "e-?")
    + r"\s*(m|mm|um|µm|nm)?\b",
    re.IGNORECASE,
)  # fmt: skip
_POISSON = re.compile(
    r"(?:poisson\W{0,3}s?\W{0,2}\s*ratio[^\n\d.,]{0,20}|\bnu\s*[=:]\s*|ν\s*[=:]\s*|\[v=)(0?[.,]\d+)",
    re.IGNORECASE,
)
_MODULUS = re.compile(
    r"^\W*(?:E(?:Hz|Hertz|_?eff)?|Young\W{0,2}s?\W?\s*modulus)\s*(?:[\[(]\s*([kMG]?Pa)\s*[\])])?\s*[=:,;\t]+\s*"
    + _NUMBER + r"\s*([kMG]?Pa)?\b",
    re.IGNORECASE | re.MULTILINE,
)  # fmt: skip
_SPRING = re.compile(
    r"^\W*(?:(?:cantilever|spring)[ -]*(?:spring[ -]*)?(?:constant|stiffness)|k)\s*"
    r"(?:[\[(]\s*([munp]?N/[mun]?m)\s*[\])])?\s*[:=,;\t ]+\s*" + _NUMBER + r"\s*([munp]?N/[mun]?m)?",
    re.IGNORECASE | re.MULTILINE,
)  # fmt: skip
_TIP = r"(?:probe|tip|indenter|punch|geometry|shape|cantilever)"
_FORMS = {
    "punch": r"flat[- ]?(?:ended)?[- ]?(?:punch|cylind\w*|tip|probe|indenter)|cylind(?:er|rical)",
    "cone": r"con(?:e|ical)",
    "pyramid": r"pyramid\w*|berkovich|vickers",
    "sphere": r"spher(?:e|ical)|ball|bead|colloid\w*",
}
_ANGLE = re.compile(r"half[- ]?(?:opening[- ]?)?angle[^\n\d]{0,20}" + _NUMBER, re.IGNORECASE)
_PASCALS = {"pa": 1.0, "kpa": 1e3, "mpa": 1e6, "gpa": 1e9}


@dataclass(frozen=True)
class Header:
    """What one file's text states; None where it says nothing. modulus_pa: by the maker's software;
    spring_n_per_m: of the spring that reads the force."""

    radius_m: float | None = None
    form: str | None = None
    half_angle_deg: float | None = None
    poisson_ratio: float | None = None
    modulus_pa: float | None = None
    spring_n_per_m: float | None = None


def of_tables(files: Sequence[Path], said: Mapping[str, Any]) -> dict[str, Any]:
    """What the texts of tables state of the tip and of Poisson's ratio, where nobody said it: fields of
    `mapping.Said`."""
    heads = [header_of(path) for path in files]
    found, notes = dict(said), []
    for name, words, unit in (("tip", "form", ""), ("tip_radius_m", "radius_m", " m")):
        stated = alike([getattr(head, words) for head in heads])
        if found.get(name) is None and stated is not None:
            found[name] = stated
            notes.append(f"the tip's {words.removesuffix('_m')} is {stated}{unit}, as the file says")
    ratio, thing = alike([head.poisson_ratio for head in heads]), dict(found.get("thing") or {})
    if ratio is not None and "poisson_ratio" not in thing:
        found["thing"] = {**thing, "poisson_ratio": ratio}
    return {**found, "notes": tuple(notes)}


def alike(values: Sequence[T | None]) -> T | None:
    """What all files that say it say alike."""
    said = {value for value in values if value is not None}
    return said.pop() if len(said) == 1 else None


def header_of(path: Path) -> Header:
    """Of a recording's samples, a text or a sheet; of other files nothing."""
    described = _description(path)
    if described is not None:
        tool = described.get("tool", {})
        return Header(
            radius_m=tool.get("tip_radius_m"),
            form=tool.get("tip"),
            half_angle_deg=tool.get("tip_angle_deg"),
            poisson_ratio=described.get("object", {}).get("poisson_ratio"),
        )
    suffix = path.suffix.lower()
    if suffix in SHEET_SUFFIXES:
        text = "\n".join(line for lines in lines_of(path).values() for line in lines[:_HEAD_ROWS])
    elif suffix in TEXT_SUFFIXES:
        with path.open("rb") as file:
            text = decoded(file.read(_HEAD_BYTES)).replace("Âµ", "µ")
    else:
        return Header()
    forms = [form for form, words in _FORMS.items() if _says(text, words)]
    angle = _ANGLE.search(text)
    return Header(
        radius_m=_radius(text),
        form=forms[0] if len(forms) == 1 else None,
        half_angle_deg=_float(angle[1]) if angle else None,
        poisson_ratio=_poisson(text),
        modulus_pa=_modulus(text),
        spring_n_per_m=_spring(text),
    )


def _description(path: Path) -> dict[str, Any] | None:
    """What a recording's TOML holds; None of other tables. Raises RecordingError for one that is damaged."""
    if not path.name.endswith((".csv", ".csv.gz")):
        return None
    ((description, _),) = description_of(path)
    held = read_toml(description, RecordingError) if description.is_file() else {}
    if "recording" not in held:  # a mapping of an import may lie there too
        return None
    check_table(held, SCHEMA, description, RecordingError, strict=False)
    return held


def _says(text: str, words: str) -> bool:
    """Whether a line that speaks of a tip names a form, in either order."""
    near = (
        rf"\b{_TIP}\b[^\n]{{0,25}}\b(?:{words})\b|\b(?:{words})\b[^\n]{{0,15}}\b(?:{_TIP}|radius|diameter)\b"
    )
    return re.search(near, text, re.IGNORECASE) is not None


def _radius(text: str) -> float | None:
    """m."""
    found = _RADIUS.search(text)
    if found is None:
        return None
    unit = (found[2] or found[4] or "m").lower().replace("µ", "u")
    size = _float(found[3]) * SI["position"][unit]
    return size / 2 if found[1].lower() == "diameter" else size


def _poisson(text: str) -> float | None:
    """As the range of the program takes it: 0.5 is stated by many, and has no digits left here."""
    found = _POISSON.search(text)
    if found is None:
        return None
    value = _float(found[1])
    assert POISSON_RATIO.high is not None
    return min(value, POISSON_RATIO.high) if value <= 0.5 else None


def _modulus(text: str) -> float | None:
    """Pa; None where none or no unit is said."""
    found = _MODULUS.search(text)
    unit = (found[1] or found[3] or "").lower() if found else ""
    return _float(found[2]) * _PASCALS[unit] if found and unit else None


def _spring(text: str) -> float | None:
    """N/m; None where none or no unit is said."""
    found = _SPRING.search(text)
    unit = (found[1] or found[3]) if found else None
    return parse_unit(unit).scale * _float(found[2]) if found and unit else None


def _float(text: str) -> float:
    return float(text.replace(",", "."))
