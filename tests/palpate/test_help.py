"""The words of every command's `--help`, in one order; and what a shell completes."""

from __future__ import annotations

import argparse
import re
import shutil
import subprocess

import pytest

from palpate import cli
from palpate.arguments import told_help
from palpate.commands.completion import SHELLS, script

UNITS = {"m", "n", "s", "hz", "pa", "kg", "n/m", "m/s", "mm", "deg", "rad", "n/s", "n_s/m", "m_per_s", "1"}


@pytest.mark.parametrize("name", cli.COMMANDS)
def test_help_says_units_before_defaults_and_nothing_that_only_python_has(name):
    parser = cli.parser_of(name)
    text = " ".join(parser.format_help().split())
    assert "(default: )" not in text and "(default: None)" not in text and "SUPPRESS" not in text
    assert not re.search(r"\bNone\b", text)
    assert not re.search(r"\(default: [^()]*\) \[", text), "a unit stands after the default"
    for action in parser._actions:
        if action.help is argparse.SUPPRESS or not action.option_strings:
            continue
        words = told_help(action.help or "")
        assert words and not words.startswith("("), f"{action.option_strings} has no words"
        shown = parser._get_formatter()._format_args(action, "VALUE")
        assert shown.lower() not in UNITS, f"{action.option_strings}: the unit belongs in brackets"
        unit = re.search(r"\[([^\]]+)\]", words)
        ending = action.option_strings[0].rsplit("-", 1)[-1]
        assert not (unit and ending == unit[1].lower() and ending in UNITS), f"{action.option_strings[0]}"


@pytest.mark.parametrize(
    ("said", "told"),
    [
        ("edge (default: 0.01) [m]", "edge [m] (default: 0.01)"),
        ("the shape's file (default: )", "the shape's file"),
        ("a place; None: as reconstructed [m] (default: None)", "a place [m] (default: as reconstructed)"),
        ("slip; default: the model's [1] (default: None)", "slip [1] (default: the model's)"),
        ("which one; '' for the first (default: )", "which one (default: the first)"),
        ("socket; '' for none (default: ws://here)", "socket; '' for none (default: ws://here)"),
        ("use holds (default: True)", "use holds (default: yes)"),
    ],
)  # fmt: skip
def test_words_are_put_in_order(said, told):
    assert told_help(said) == told


def test_a_flag_is_shown_without_its_unit_and_taken_with_it_too():
    parser = cli.parser_of("reconstruct")
    assert "--least-duration-s" not in parser.format_help()
    for flag in ("--least-duration", "--least-duration-s"):
        assert parser.parse_args(["REC", "-o", "MODEL", flag, "0.1"]).least_duration_s == 0.1


@pytest.mark.parametrize("shell", SHELLS)
def test_completion_knows_every_command_and_its_options(shell):
    text = script(shell)
    assert all(name in text for name in cli.COMMANDS)
    assert "neo-hookean" in text and "mesh-size" in text and "least-duration-s" not in text


@pytest.mark.skipif(not shutil.which("bash"), reason="needs bash")
@pytest.mark.parametrize(
    ("words", "expected"),
    [
        (["palpate", "reco"], {"reconstruct"}),
        (["palpate", "reconstruct", "--mesh-si"], {"--mesh-size"}),
        (["palpate", "reconstruct", "--dent-law", "neo"], {"neo-hookean"}),
        (["palpate", "export", "--to", "s"], {"sofa", "stl"}),
    ],
)
def test_bash_completes(words, expected):
    ask = f'COMP_WORDS=({" ".join(words)}); COMP_CWORD={len(words) - 1}; _palpate; echo "${{COMPREPLY[@]}}"'
    done = subprocess.run(["bash", "-c", script("bash") + ask], capture_output=True, text=True, check=True)
    assert set(done.stdout.split()) == expected, done.stderr
