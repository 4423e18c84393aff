"""What the columns of other people's tables are: said by name, number or a mapping file, else guessed from
names, by the words of vocabulary.toml.

A mapping file is TOML:

    [columns]   t, x, y, z, fx, fy, fz, qw, qx, qy, qz: a column's name, '#3' its number, 'topic:name' of
    one of
                several tables, '-name' its negative, '=0' a constant
    [units]     time, position, force: where the columns' names do not tell
    [tool]      tip_radius_m, mass_kg, flange_to_tip_m = [x, y, z] (tool frame)
    [sensor]    force_on = "tool" | "object", frame = "device" | "tool", rotation = 3 x 3 (sensor to frame)
    [clock]     offset_s (of the force's clock; "auto" by cross-correlation), rate_hz
    [tare]      start_s, end_s: the mean force there is taken off
    [object]    name, poisson_ratio, shape, shape_unit, shape_pose, slab_m, half_space

What the name of a column says of it, by the words of vocabulary.toml.
"""

from __future__ import annotations

import re
import tomllib
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from functools import lru_cache
from os.path import commonprefix
from pathlib import Path
from typing import Any

import numpy as np

from palpate.importing.tables import SI, Table, plain, unit_in, unit_since_1970, without_unit
from palpate.mechanics.disk.reading import read_toml
from palpate.mechanics.disk.schema import ANY, FileKey, Schema, check_table
from palpate.mechanics.errors import RecordingError
from palpate.mechanics.plausible import MACHINE_TIP_RADIUS, TOOL_MASS
from palpate.mechanics.recording.files import SCHEMA
from palpate.words import listed

_AXES = {"x": "x|0", "y": "y|1", "z": "z|2"}


@lru_cache(maxsize=1)
def vocabulary() -> Mapping[str, Any]:
    """The tables of vocabulary.toml."""
    return tomllib.loads(Path(__file__).with_name("vocabulary.toml").read_text(encoding="utf-8"))


@lru_cache(maxsize=16)
def says(role: str) -> re.Pattern[str]:
    """What the letters and digits of a whole name match that says the role."""
    held = vocabulary()
    if role == "t":
        return re.compile("|".join(held["time"]["names"]))
    words = held["words"]
    body, nothing = "|".join(words["body"]), "|".join(words["nothing"])
    exactly = [role, *held["exactly"].get(role, [])]
    if role.startswith("q"):
        own, other, axes = "|".join(words["quaternion"]), f"{body}|{nothing}", f"{role}|{role[1]}"
    elif role.startswith("f"):
        own, other, axes = "|".join(words["force"]), f"{body}|{nothing}", _AXES[role[1]]
    else:
        own, other, axes = "|".join([*words["position"], body]), nothing, _AXES[role]
    return re.compile(f"{'|'.join(exactly)}|(?:{other})*(?:{own})(?:{own}|{other})*(?:{axes})")


ROLES = ("t", "x", "y", "z", "fx", "fy", "fz", "qw", "qx", "qy", "qz")
KIND = {"t": "time", **dict.fromkeys("xyz", "position"), **dict.fromkeys(("fx", "fy", "fz"), "force")}
_NUMBERS = {
    "tip_radius_m": MACHINE_TIP_RADIUS,
    "mass_kg": TOOL_MASS,
    "flange_to_tip_m": FileKey(low=-2.0, high=2.0, size=3, unit="m"),
    "rate_hz": FileKey(low=1e-3, high=1e6, unit="Hz"),
    "tare_s": FileKey(size=2, unit="s"),
}
MAPPING: Schema = {
    "columns": dict.fromkeys(ROLES),
    "units": dict.fromkeys(SI, FileKey(str)),
    "tool": {
        "tip": SCHEMA["tool"]["tip"],  # type: ignore[index]
        **{name: _NUMBERS[name] for name in ("tip_radius_m", "mass_kg", "flange_to_tip_m")},
    },
    "sensor": {
        "force_on": FileKey(str, choices=("tool", "object")),
        "frame": FileKey(str, choices=("device", "tool")),
        "rotation": ANY,
    },
    "clock": {"offset_s": ANY, "rate_hz": _NUMBERS["rate_hz"]},
    "tare": {"start_s": FileKey(unit="s"), "end_s": FileKey(unit="s", required=True)},
    "object": {
        key: form
        for key, form in SCHEMA["object"].items()  # type: ignore[union-attr]
        if key != "model"
    },
}
"""What a mapping file may hold."""


@dataclass(frozen=True)
class Said:
    """Everything that a mapping says; None or empty where it says nothing."""

    columns: Mapping[str, str] = field(default_factory=dict)
    units: Mapping[str, str] = field(default_factory=dict)
    tip_radius_m: float | None = None
    tip: str | None = None
    mass_kg: float = 0.0
    flange_to_tip_m: Sequence[float] | None = None
    force_on: str | None = None
    frame: str = "device"
    rotation: Any = None
    offset_s: float | str | None = None
    rate_hz: float | None = None
    clock: str | None = None
    tare_s: tuple[float, float] | None = None
    thing: Mapping[str, Any] = field(default_factory=dict)
    notes: tuple[str, ...] = ()
    """Where something of it was found."""

    def __post_init__(self) -> None:
        """Raises RecordingError for a role, unit, frame or body that does not exist."""
        for name, value, allowed in (
            ("force_on", self.force_on, (None, "tool", "object")),
            ("clock", self.clock, (None, "one", "blocks")),
            ("frame", self.frame, ("device", "tool")),
        ):
            if value not in allowed:
                raise RecordingError(f"{name} is {value!r}; allowed are {listed(filter(None, allowed))}")
        for role in self.columns:
            if role not in ROLES:
                raise RecordingError(f"'{role}' is no column of a recording; allowed are {', '.join(ROLES)}")
        for kind, unit in self.units.items():
            if kind not in SI:
                raise RecordingError(f"units of '{kind}' are not used; allowed are {', '.join(SI)}")
            if plain(unit) not in SI[kind]:
                raise RecordingError(f"'{unit}' is no unit of {kind}; allowed are {', '.join(SI[kind])}")
        for name, key in _NUMBERS.items():
            given = getattr(self, name)
            if given is not None and not key.takes(np.asarray(given).tolist()):
                raise RecordingError(f"{name} is {given}; it must be {key.words}{_in_mm(key, given)}")


def _in_mm(key: FileKey, given: Any) -> str:
    """What a length would be, had it been given in mm; '' where that is not allowed either."""
    metres = given / 1e3 if key.unit == "m" and isinstance(given, int | float) else given
    return f": is it mm? in metres it is {metres}" if key.takes(metres) else ""


def read_mapping(path: Path | str) -> dict[str, Any]:
    """The fields of a mapping file; raises RecordingError for one that is no TOML or has another key."""
    path = Path(path)
    held = read_toml(path, RecordingError)
    check_table(held, MAPPING, path, RecordingError, strict=True)
    found: dict[str, Any] = {}
    for table in ("columns", "units"):
        if table in held:
            found[table] = {k: str(v) for k, v in held[table].items()}
    for table in ("tool", "sensor", "clock"):
        found |= held.get(table, {})
    if "tare" in held:
        found["tare_s"] = (float(held["tare"].get("start_s", 0.0)), float(held["tare"]["end_s"]))
    if "object" in held:
        found["thing"] = held["object"]
        if "shape" in held["object"]:
            found["thing"] |= {"shape": str(path.parent / held["object"]["shape"])}
    return found


@dataclass(frozen=True)
class Column:
    """One column found: its table, its name there, factor to SI (with its sign), and the unit it was taken
    in; assumed: nobody said the unit; unit_said: a person did, beside the names."""

    role: str
    table: Table | None
    name: str
    factor: float
    unit: str
    guessed: bool
    assumed: bool = False
    unit_said: bool = False

    @property
    def values(self) -> np.ndarray | float:
        """(n,) in SI, or a constant."""
        if self.table is None:
            return self.factor
        return self.factor * self.table.columns[self.name]

    def __str__(self) -> str:
        if self.table is None:
            return f"{self.role} = {self.factor:g}"
        sign = "-" if self.factor < 0 else ""
        own = unit_in(self.name, KIND[self.role]) if self.role in KIND else None
        unit = "" if own == self.unit else f" [{self.unit}]"
        how = "guessed" if self.guessed else "said"
        if self.guessed and (self.unit_said or self.assumed or own):
            how += ", unit " + ("said" if self.unit_said else "assumed" if self.assumed else "stated")
        return f"{self.role} = {sign}{self.name}{unit} ({how})"


_ORDERED = re.compile(r"(.*?)_?(xyzw|wxyz)\W*(\d)\W*$", re.IGNORECASE)
"""An array of quaternions whose name tells the order of its columns."""


def _key(name: str) -> str:
    ordered = _ORDERED.match(name)
    if ordered and int(ordered[3]) < 4:
        name = ordered[1] + "_q" + ordered[2][int(ordered[3])]
    return re.sub(r"[^a-z0-9]", "", without_unit(name).lower())


def find_columns(tables: Sequence[Table], said: Said) -> dict[str, Column]:
    """Each role's column: what was said, else what the names tell.

    Raises RecordingError where position or force cannot be told, naming the columns that there are.
    """
    found = told_columns(tables, said)
    for kind, roles in (("position", "xyz"), ("force", ("fx", "fy", "fz"))):
        missing = [role for role in roles if role not in found]
        if missing and any(map(_split_at_decimals, tables)):
            raise RecordingError(
                "decimal commas? Every second column holds whole numbers alone, and the separator is a comma "
                "too, so where a number ends cannot be told: write the file with ';' or tabs between its "
                "columns, or with decimal points"
            )
        if missing:
            of_curve = "depth" if kind == "position" else "load"
            alone = f", or of a machine's curve --column {of_curve}=NAME" * (len(missing) == len(roles))
            raise RecordingError(
                f"which columns are {kind} ({', '.join(missing)}) cannot be determined from their names; "
                f"give it with --column {missing[0]}=NAME (or '#3', '=0'){alone}: there are {_listed(tables)}"
            )
    if any(q in found for q in ROLES[7:]) and not all(q in found for q in ROLES[7:]):
        found = {role: column for role, column in found.items() if not role.startswith("q")}
    return found


def _split_at_decimals(table: Table) -> bool:
    """Whether the columns have no names, and every second one may be the decimals of the one before it."""
    decimals = np.array([*table.columns.values()][1::2])
    whole = (decimals >= 0) & (decimals == np.floor(decimals))
    unnamed = all(re.fullmatch(r"#\d+", name) for name in table.columns)
    return unnamed and len(table.columns) % 2 == 0 and len(decimals) > 2 and bool(whole.all())


def told_columns(tables: Sequence[Table], said: Said) -> dict[str, Column]:
    """The same of those roles alone that something tells."""
    found = {role: _said(tables, role, text, said) for role, text in said.columns.items()}
    for role in ROLES:
        if role not in found:
            guess = _guess(tables, role)
            if guess is not None:
                found[role] = _column(role, *guess, said, guessed=True)
    _complete(tables, said, found)
    return found


def named_columns(tables: Sequence[Table], roles: Sequence[str], said: Said) -> dict[str, Column]:
    """The columns of those roles that the names tell."""
    guesses = {role: _guess(tables, role) for role in roles}
    return {r: _column(r, *guess, said, guessed=True) for r, guess in guesses.items() if guess is not None}


def _listed(tables: Sequence[Table]) -> str:
    each = [n for t in tables for n in t.columns]
    names = [f"{t.name}:{n}" if each.count(n) > 1 else n for t in tables for n in t.columns]
    return ", ".join(names[:40]) + (f" and {len(names) - 40} more" if len(names) > 40 else "")


def _said(tables: Sequence[Table], role: str, text: str, said: Said) -> Column:
    text = text.strip()
    if text.startswith("="):
        try:
            return Column(role, None, "", float(text[1:]), "", False)
        except ValueError as error:
            raise RecordingError(f"{role}: '{text}' is no constant; write =0 or =0.01, in SI") from error
    sign = -1.0 if text.startswith("-") and not any(text in t.columns for t in tables) else 1.0
    name = text[1:] if sign < 0 else text
    matches = []
    for table in tables:
        own = name.removeprefix(f"{table.name}:")
        if own in table.columns:
            matches.append((table, own))
        elif re.fullmatch(r"#\d+", own) and 0 < int(own[1:]) <= len(table.columns):
            matches.append((table, list(table.columns)[int(own[1:]) - 1]))
        else:
            alike = [n for n in table.columns if without_unit(n).strip().lower() == own.lower()]
            matches += [(table, alike[0])] if len(alike) == 1 else []
    if len(matches) != 1:
        why = "is in several tables: write TABLE:NAME" if matches else "is not there"
        raise RecordingError(f"{role}: column '{name}' {why}; there are {_listed(tables)}")
    return _column(role, *matches[0], said, sign=sign)


def _column(
    role: str, table: Table, name: str, said: Said, *, sign: float = 1.0, guessed: bool = False
) -> Column:
    kind = KIND.get(role)
    if kind is None:
        return Column(role, table, name, sign, "1", guessed)
    unit = plain(said.units[kind]) if kind in said.units else unit_in(name, kind)
    if unit is None and kind == "time":
        unit = unit_since_1970(np.asarray(table.columns[name], dtype=float))
    assumed = unit is None
    unit = unit or next(iter(SI[kind]))
    return Column(role, table, name, sign * SI[kind][unit], unit, guessed, assumed, kind in said.units)


def _guess(tables: Sequence[Table], role: str) -> tuple[Table, str] | None:
    """The one column whose name says the role; None where none or several do."""
    matches = []
    for table in tables:
        inside = _shared_prefix(table)
        own_name = {name: _key(name[inside:]) for name in table.columns}
        named = [name for name, own in own_name.items() if says(role).fullmatch(own) or _ends(name, role)]
        # X (N) is a force, whatever X is else
        named += [name for name, own in own_name.items() if role[0] == "f" and own == role[1]]
        own = [name for name in dict.fromkeys(named) if _may_be(name, role, own_name[name])]
        matches += [(table, name) for name in own[:1] if len(own) == 1 or role == "t"]
    if role == "t":
        return matches[0] if len(matches) >= 1 else None
    return matches[0] if len(matches) == 1 else None


def _shared_prefix(table: Table) -> int:
    """Length of the structure's name that all columns begin with: data.x, data.y."""
    return commonprefix(list(table.columns)).rfind(".") + 1 if len(table.columns) > 1 else 0


def _may_be(name: str, role: str, own: str) -> bool:
    """Whether the unit in a column's name is of the role's kind, or tells no kind."""
    kinds = [kind for kind in SI if unit_in(name, kind) is not None]
    if role[0] == "f" and own == role[1]:
        return "force" in kinds
    return not kinds or KIND.get(role) in kinds


def _ends(name: str, role: str) -> bool:
    """Whether the end of a dotted name says the role: msg.wrench.force.x."""
    parts = re.split(r"[./]", name)
    last, whole = _key(parts[-1]), says(role)
    # an axis alone is anything's
    return len(parts) > 1 and bool(
        (len(last) > 1 and whole.fullmatch(last))
        or any(whole.fullmatch(_key("".join(parts[-k:]))) for k in (2, 3))
    )


def _complete(tables: Sequence[Table], said: Said, found: dict[str, Column]) -> None:
    """A machine with one axis: its travel is downward z, its push fz; what is missing is 0."""
    sideways = any(
        _key(name[_shared_prefix(table) :]) in ("x", "y") for table in tables for name in table.columns
    )
    if not sideways and not any(role in found for role in "xyz"):
        along = named_first(tables, "travel") or _only_of(tables, "position")
        if along is not None:
            # travel counts into the sample, z out of it
            bare = _key(along[1][_shared_prefix(along[0]) :])
            sign = 1.0 if bare in vocabulary()["travel"]["out"] else -1.0
            found["z"] = _column("z", *along, said, sign=sign, guessed=True)
    if not any(role in found for role in ("fx", "fy", "fz")):
        push = named_first(tables, "load") or _only_of(tables, "force")
        if push is not None:
            found["fz"] = _column("fz", *push, said, guessed=True)
    for axes in (("x", "y", "z"), ("fx", "fy", "fz")):
        there = [axis for axis in axes if axis in found]
        if len(there) == 1 and there[0][-1] == "z":
            found.update({axis: Column(axis, None, "", 0.0, "", True) for axis in axes[:2]})


def _only_of(tables: Sequence[Table], kind: str) -> tuple[Table, str] | None:
    """The one column whose unit is of a kind, whatever it is called."""
    own = [(table, n) for table in tables for n in table.columns if unit_in(n, kind) is not None]
    return own[0] if len(own) == 1 else None


def named_first(tables: Sequence[Table], what: str) -> tuple[Table, str] | None:
    """The column with the likeliest name of a machine's "travel" or "load"."""
    for word in vocabulary()[what]["names"]:
        for table in tables:
            inside = _shared_prefix(table)
            names = [name for name in table.columns if _key(name[inside:]) == word]
            if names:
                return table, names[0]
    return None
