"""A new operation is one file and its line in the one list: a Python call, a command, flags, help, JSON."""

from __future__ import annotations

import inspect
import json

import pytest

import palpate as pp
from palpate import cli
from palpate.operations._list import OPERATIONS, Entry, calls, commands

FILE = '''
"""Hooke's law: how far a spring gives."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated

from palpate.mechanics import options
from palpate.operations._declare import argument, operation, option


@dataclass(frozen=True)
class SpringOptions:
    stiffness_n_per_m: float = options.option(200.0, "of the spring", unit="N/m", low=1.0, high=1e4)


@dataclass(frozen=True)
class Stretched:
    by_m: float

    def lines(self):
        return [f"stretched by {1e3 * self.by_m:g} mm"]

    def as_json(self):
        return {"by_m": self.by_m}


@operation()
def stretch(
    force_n: Annotated[float, argument("that pulls", unit="N", metavar="FORCE")],
    *,
    twice: Annotated[bool, option("two springs in a row")] = False,
    spring: SpringOptions,
) -> Stretched:
    """How far a spring gives, m. Raises OptionError."""
    by = force_n / spring.stiffness_n_per_m
    return Stretched(2 * by if twice else by)
'''


@pytest.fixture
def added(tmp_path, monkeypatch):
    (tmp_path / "stretch_of_a_test.py").write_text(FILE)
    monkeypatch.syspath_prepend(str(tmp_path))
    monkeypatch.setitem(
        OPERATIONS, "stretch", Entry("how far a spring gives", "stretch", "stretch_of_a_test")
    )
    yield
    vars(pp).pop("stretch", None)


def test_it_is_called_from_python(added):
    assert "stretch" in calls()
    assert pp.stretch(1.0).by_m == pytest.approx(0.005)
    assert pp.stretch(force_n=1.0, twice=True, stiffness_n_per_m=100.0).by_m == pytest.approx(0.02)
    parameters = inspect.signature(pp.stretch).parameters
    assert list(parameters) == ["force_n", "twice", "stiffness_n_per_m", "progress"]
    assert parameters["stiffness_n_per_m"].default == 200.0
    assert "stiffness_n_per_m [N/m]: of the spring" in inspect.getdoc(pp.stretch)
    assert [option.name for option in pp.options("stretch")] == ["twice", "stiffness_n_per_m"]
    with pytest.raises(pp.OptionError, match="pp.stretch has no option 'stiffness': did you mean"):
        pp.stretch(1.0, stiffness=3.0)
    with pytest.raises(pp.OptionError, match="allowed are numbers from 1 to 10000"):
        pp.stretch(1.0, stiffness_n_per_m=0.0)
    with pytest.raises(TypeError, match="force_n"):
        pp.stretch()


def test_it_is_a_command_with_flags_help_and_json(added, capsys):
    assert "stretch" in commands()
    assert cli.main(["stretch", "1", "--stiffness", "100", "--twice", "--json", "-"]) == 0
    assert json.loads(capsys.readouterr().out) == {"by_m": 0.02}
    assert cli.main(["stretch", "1"]) == 0
    assert capsys.readouterr().out == "stretched by 5 mm\n"
    with pytest.raises(SystemExit):
        cli.main(["stretch", "--help"])
    shown = " ".join(capsys.readouterr().out.split())
    assert "Hooke's law" in shown and "of the spring [N/m] (default: 200.0)" in shown
    assert cli.main(["stretch", "1", "--stiffness", "0"]) == 2
    assert "allowed are numbers from 1 to 10000 N/m" in capsys.readouterr().err
