"""Curves of a testing machine that cannot be meant are refused in one line."""

from __future__ import annotations

import numpy as np
import pytest

from palpate import cli

from .inputs import refused, text_of


def curve(t=1.0, z=1.0, fz=1.0, rows=400):
    """A sphere's indentation of 2 mm into 20 kPa, its columns times anything."""
    time = np.linspace(0.0, 2.0, rows)
    depth = 0.002 * (1 - np.abs(time - 1))
    table = np.column_stack([t * time, -z * depth, fz * 1.9e4 * np.sqrt(0.005) * depth**1.5])
    return text_of(table, "t,z,fz")


def relaxation(t=1.0, value=1.0, rows=400):
    time = np.linspace(0.0, 2.0, rows)
    return text_of(np.column_stack([t * time, value * (1 + np.exp(-time))]), "time,relaxation modulus")


TIP = ("--tip-radius", "0.005")
CURVES = {
    "travel of kilometres": ("travels 1995 m.*--units position", curve(z=1e6), *TIP),
    "a load beyond any": ("load above 1e\\+09 N.*--units force", curve(fz=1e300), *TIP),
    "a few rows": ("3 rows in order of time: 8", curve(rows=3), *TIP),
    "time backwards": ("1 rows in order of time: 8", curve(t=-1.0), *TIP),
    "a layer thinner than the dent": ("into a layer of 1e-09 m", curve(), *TIP, "--layer", "1e-9"),
    "nu of 2": ("from 0 to 0.4999", curve(), *TIP, "--poisson-ratio", "2"),
    "nu of -3": ("from 0 to 0.4999", curve(), *TIP, "--poisson-ratio", "-3"),
    "a relaxation of two rows": ("2 rows in order of time: 8", relaxation(rows=2)),
    "a relaxation beyond any": ("above 1e\\+15", relaxation(t=1e300)),
    "a modulus beyond any": ("above 1e\\+15", relaxation(value=1e300)),
}


def test_rows_without_a_number_are_told_of_and_most_of_them_refused(tmp_path, capsys):
    lines = curve().splitlines()
    some = [",".join([*line.split(",")[:2], "nan"]) if k % 10 == 5 else line for k, line in enumerate(lines)]
    (tmp_path / "dent.csv").write_text("\n".join(some) + "\n")
    assert cli.main(["material", str(tmp_path / "dent.csv"), "--fast", *TIP]) == 0
    said = capsys.readouterr().err
    assert "40 of 400 rows" in said and "row 5" in said
    most = [",".join([*line.split(",")[:2], "nan"]) if k % 10 > 3 else line for k, line in enumerate(lines)]
    (tmp_path / "dent.csv").write_text("\n".join(most) + "\n")
    refused("240 of 400 rows lack a number", "material", str(tmp_path / "dent.csv"), "--fast", *TIP)


@pytest.mark.parametrize("name", CURVES)
def test_hostile_curves_of_a_machine_are_refused_in_one_line(tmp_path, name, recwarn):
    words, text, *line = CURVES[name]
    (tmp_path / "dent.csv").write_text(text)
    refused(words, "material", str(tmp_path / "dent.csv"), "--fast", *line)
    assert not list(recwarn)
