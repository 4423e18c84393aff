"""Units are parsed, not listed: dimensions, what people read, and one spelling everywhere."""

from __future__ import annotations

import ast
from pathlib import Path

import pytest

from palpate.mechanics.disk.schema import FileKey
from palpate.mechanics.effects.registry import effects
from palpate.mechanics.errors import OptionError
from palpate.mechanics.model import files as model_files
from palpate.mechanics.plausible import COLUMN, CURVE, EXPLORATION, TIP_RADIUS, USUAL_TIP_RADIUS_M
from palpate.mechanics.quantities import parse_unit, prefixed, quantity_words, read_unit, unit_of_key
from palpate.mechanics.recording import recording

from ..conftest import rooms

ROOT = Path(__file__).resolve().parents[2]
WITHOUT_UNIT_IN_NAME = {"boundary_phase": "s", "support_point": "m", "angle": "rad"}


@pytest.mark.parametrize(
    ("unit", "same"),
    [("J", "N m"), ("Pa", "N/m^2"), ("W", "J/s"), ("kg", "N s^2/m"), ("J/m^2", "N/m"), ("Hz", "1/s"),
     ("m^2/s", "m m/s"), ("kPa/mm", "MPa/m"), ("uN", "um kPa mm")],
)  # fmt: skip
def test_derived_units_are_products_of_metres_newtons_and_seconds(unit, same):
    one, other = parse_unit(unit), parse_unit(same)
    assert one[1:] == other[1:]
    assert one.scale == pytest.approx(other.scale, rel=1e-12)


@pytest.mark.parametrize("unit", ["N/m^r", "N s/m^(r+1)", "ln s", "furlong", "N/", "", "m/s/s", "krad"])
def test_what_has_no_fixed_dimension_is_refused(unit):
    with pytest.raises(OptionError, match="no unit of fixed dimension"):
        parse_unit(unit)


def test_what_people_read_is_the_same_quantity():
    for unit in ("m", "s", "N", "Pa", "kg", "rad", "m/s", "N/s", "N/m", "Pa/m", "m^2/s", "J/m^2"):
        shown, factor = read_unit(unit)
        plain = shown.replace("²", "^2").replace("degrees", "deg")
        assert parse_unit(plain).scale * factor == pytest.approx(parse_unit(unit).scale)
        assert parse_unit(plain)[1:] == parse_unit(unit)[1:]
    assert read_unit("N/m") == ("N/mm", 1e-3) and read_unit("1") == ("", 1.0)
    assert prefixed("N", 0.2) == ("mN", 1e3) and prefixed("N", 3.0) == ("N", 1.0)
    assert prefixed("Pa", 3e4) == ("kPa", 1e-3)


def _keys(schema, names=()):
    for name, form in schema.items():
        if isinstance(form, FileKey):
            yield name, form.unit
        elif isinstance(form, dict):
            yield from _keys(form, (*names, name))


def test_a_key_states_the_unit_that_its_name_ends_with():
    tables = [e.keys for e in effects()] + [recording.SCHEMA, model_files.SCHEMA]
    stated = [pair for table in tables for pair in _keys(table or {})]
    stated += [(p.name, p.unit) for e in effects() for p in e.parameters if not p.unit.startswith("ln ")]
    unlike = {name: unit for name, unit in stated if (unit or "1") != unit_of_key(name)}
    assert unlike == WITHOUT_UNIT_IN_NAME


def test_every_unit_that_the_program_states_can_be_parsed():
    stated = {
        (path.name, keyword.value.value)
        for folder in rooms(ROOT)
        for path in (ROOT / folder).rglob("*.py")
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8")))
        if isinstance(node, ast.Call) and getattr(node.func, "id", "") in ("option", "FileKey")
        for keyword in node.keywords
        if keyword.arg == "unit" and isinstance(keyword.value, ast.Constant)
    }
    assert len(stated) > 40
    for _, unit in stated:
        parse_unit(unit)


@pytest.mark.parametrize(
    ("key", "value", "said"),
    [
        ("stiffness_n_per_m", 68e3, "68 N/mm"),
        ("delay_s", 0.025, "25 ms"),
        ("tau_s", [0.084, 20.0], "(0.084, 20) s"),
        ("tau_s", 20.0, "20 s"),
        ("young_modulus_pa", 28910.0, "28.9 kPa"),
        ("young_modulus_pa", 2.5e6, "2.5 MPa"),
        ("bias_n", [0.05, 0.0, -0.01], "(50, 0, -10) mN"),
        ("mu", 0.123, "0.12"),
        ("diffusivity_m2_per_s", 8.7e-7, "0.87 mm²/s"),
        ("inside", True, "yes"),
        ("g", [0.3], "0.3"),
        ("pattern", list(range(20)), "0 to 19 (20 values)"),
    ],
)
def test_values_are_said_as_people_write_them(key, value, said):
    assert quantity_words(key, value) == said


@pytest.mark.parametrize("name", EXPLORATION)
def test_what_is_plausible_goes_with_its_unit_and_is_possible(name):
    row = EXPLORATION[name]
    if not row.stated:
        unit, (time, position, force, tip) = parse_unit(row.unit), row.powers
        assert (unit.time, unit.length, unit.force) == (time, position + tip, force)
    assert row.low <= row.usual <= row.high and row.likely[0] <= row.usual <= row.likely[1]
    assert row.off(row.usual) == 0 and row.off(row.usual * row.factor) == pytest.approx(1)


def test_the_usual_is_possible_everywhere():
    for row in (*COLUMN.values(), *CURVE.values()):
        parse_unit(row.unit)
        assert row.usual != row.usual or row.low <= row.usual <= row.high
    assert TIP_RADIUS.takes(USUAL_TIP_RADIUS_M)
