"""Command lines with absurd options, or outputs that would replace what is read, are refused in one line."""

from __future__ import annotations

import dataclasses

import pytest

from palpate.mechanics.errors import PalpateError
from palpate.mechanics.options import check_range, option

from .inputs import command, contents, refused

PRESS = ("press", "M", "--at", "0,0,0", "--direction", "0,0,-1", "--depth", "0.001")
REPLACED = {
    "forces over the recording": ("would replace what REC names", "replay", "M", "REC", "-o", "REC"),
    "JSON over the recording": ("--json would replace what REC names", "replay", "M", "REC", "--json", "REC"),
    "a curve over the model": (
        "-o would replace|--output would replace",
        *PRESS,
        "-o",
        "M/model.toml",
    ),
    "a curve over a text": (
        "is no curve of palpate press",
        *PRESS,
        "-o",
        "notes/thesis.txt",
    ),
    "a curve over a folder": (
        "is a folder: name a file",
        *PRESS,
        "-o",
        "notes",
    ),
    "a model over a folder of texts": ("is no MODEL folder", "reconstruct", "REC", "-o", "notes"),
    "a model over a text": ("is no folder", "reconstruct", "REC", "-o", "notes/thesis.txt"),
    "a model over the current folder": ("current folder", "reconstruct", "REC", "-o", "."),
    "a model over the model that is read": (
        "--apply would replace what --model names",
        "diagnose",
        "REC",
        "--model",
        "M",
        "--apply",
        "M",
    ),
    "a better recording over itself": (
        "--corrected would replace what REC names",
        "diagnose",
        "REC",
        "--corrected",
        "REC",
    ),
    "a report over a text": ("is no page of palpate", "compare", "REC", "-o", "notes/thesis.txt"),
    "a report under a file": (
        "a part of the path is a file",
        "compare",
        "REC",
        "-o",
        "notes/thesis.txt/r.html",
    ),
    "JSON and report as one": ("both name", "compare", "REC", "-o", "new.html", "--json", "new.html"),
    "a session over what it replays": (
        "--record would replace what --replay names",
        "touch",
        "M",
        "--headless",
        "--device",
        "replay",
        "--replay",
        "REC",
        "--record",
        "REC",
    ),
    "a recording over a text of that name": (
        "is no recording's description",
        "simulate",
        "block",
        "-o",
        "notes/other.csv",
    ),
    "JSON to a device": ("no ordinary file", "compare", "REC", "--json", "/dev/full"),
    "a name too long": ("use a shorter name", "compare", "REC", "--json", "n" * 300 + ".json"),
    "a dangling link": ("is a link to", "compare", "REC", "--json", "dangling.json"),
    "a loop of links": ("loop|circle", "compare", "REC", "--json", "loop/x.json"),
}


@pytest.mark.parametrize("name", REPLACED)
def test_an_output_replaces_no_input_and_nothing_of_another_kind(folder, record, tmp_path, monkeypatch, name):
    recording = record()
    (tmp_path / "notes").mkdir()
    (tmp_path / "notes" / "thesis.txt").write_text("years of work")
    (tmp_path / "notes" / "model.toml").write_text("not of this program")
    (tmp_path / "notes" / "other.toml").write_text("mine = 1")
    (tmp_path / "dangling.json").symlink_to("nowhere/at/all.json")
    (tmp_path / "loop").symlink_to("loop")
    monkeypatch.chdir(tmp_path)
    before = contents(tmp_path)
    known = {"REC": recording.name, "M": folder.name, "M/model.toml": f"{folder.name}/model.toml"}
    words, *line = REPLACED[name]
    refused(words, *(known.get(word, word) for word in line))
    assert contents(tmp_path) == before


EXPLORE = ("explore", "--phantom", "dome", "-o", "new.csv")
ABSURD = {
    "a mesh of 1e-5": ("from 0.0005 to 0.2 m", "reconstruct", "REC", "-o", "new", "--mesh-size", "1e-5"),
    "a memory of nan": ("not a finite number", "batch", "REC", "-o", "new", "--memory", "nan"),
    "a mesh of nan": ("from 0.0005 to 0.2 m", "reconstruct", "REC", "-o", "new", "--mesh-size", "nan"),
    "a negative seed": ("0 or greater", "simulate", "block", "-o", "new.csv", "--seed", "-1"),
    "a negative person": ("0 or greater", "simulate", "block", "-o", "new.csv", "--person", "-1"),
    "a seed of 40 digits": ("0 or greater", "simulate", "block", "-o", "new.csv", "--seed", "9" * 40),
    "negative presses": ("from 0", "simulate", "block", "-o", "new.csv", "--presses", "-1"),
    "no workers": ("workers is 0", "simulate", "block", "-o", "new.csv", "--workers", "0"),
    "a finest mesh of 0": ("from 0.5 to 1000 mm", "simulate", "block", "-o", "new.csv", "--finest", "0"),
    "a tip of 1 m": ("from 0.0001 to 0.04 m", "simulate", "block", "-o", "new.csv", "--tip-radius", "1"),
    "a speed of 0": ("from 0.0001 to 10 m/s", "simulate", "block", "-o", "new.csv", "--slowest", "0"),
    "a negative noise": (
        "from 0 to 1000 N",
        "simulate",
        "block",
        "-o",
        "new.csv",
        "--force-noise-std",
        "-1",
    ),
    "friction of nan": (
        "friction|nan",
        *PRESS,
        "--friction",
        "nan",
    ),
    "an infinite depth": (
        "not a finite number",
        "press",
        "M",
        "--at",
        "0,0,0",
        "--direction",
        "0,0,-1",
        "--depth",
        "inf",
    ),
    "deeper than the object": ("from 0.01 to 0.9", *EXPLORE, "--deepest-share", "5"),
    "a phantom of 0 Pa": ("young_modulus_pa is 0", *EXPLORE, "--modulus", "0"),
    "a phantom of nan Pa": ("young_modulus_pa is nan", *EXPLORE, "--modulus", "nan"),
    "a phantom of 1e30 Pa": ("young_modulus_pa is 1e.30", *EXPLORE, "--modulus", "1e30"),
    "an object of nu 0.5": (
        "from 0 to 0.4999",
        "explore",
        "--robot",
        "-o",
        "new.csv",
        "--poisson-ratio",
        "0.5",
    ),
    "a touch of no force": ("from 0.01 to", *EXPLORE, "--strongest", "0"),
    "a recording that is none": ("must end in .csv", "explore", "--phantom", "dome", "-o", "new.txt"),
    "a laboratory's recording that is none": ("must end in .csv", "simulate", "block", "-o", "new.mat"),
    "a place of 1e200": ("beyond any quantity", "press", "M", "--at", "1e200,0,0", "--direction", "0,0,-1"),
    "a direction of 1e200": (
        "beyond any quantity",
        "press",
        "M",
        "--at",
        "0,0,0",
        "--direction",
        "0,0,-1e200",
    ),
    "nu of -0.99": ("from 0 to 0.4999", "reconstruct", "REC", "-o", "new", "--poisson-ratio", "-0.99"),
}


@pytest.mark.parametrize("name", ABSURD)
def test_absurd_options_are_refused_before_any_work(folder, record, tmp_path, monkeypatch, name):
    monkeypatch.chdir(tmp_path)
    recording = record()
    known = {"REC": recording.name, "M": folder.name}
    words, *line = ABSURD[name]
    refused(words, *(known.get(word, word) for word in line))
    assert not list(tmp_path.glob("new*"))


def test_every_default_is_within_its_range():
    from palpate.devices.registry import DEVICES, options_of
    from palpate.operations._declare import operation_of
    from palpate.operations._list import calls
    from palpate.servo import SafetyOptions, ServoOptions

    everything = {kind for name in calls() for kind in operation_of(name).kinds}
    everything |= {options_of(name) for name in DEVICES}
    for kind in everything | {SafetyOptions, ServoOptions}:
        for field in dataclasses.fields(kind):
            if "help" in field.metadata:
                check_range(field, field.default, f"{kind.__name__}.{field.name}")


def test_infinite_friction_is_an_option_as_documented():
    from palpate.render.options import RenderOptions

    field = RenderOptions.__dataclass_fields__["friction"]
    check_range(field, float("inf"))
    with pytest.raises(PalpateError, match="allowed are numbers from 1 to 2 m"):
        check_range(_Named("x", option(1.0, "words", unit="m", low=1, high=2)), 3.0)


class _Named:
    def __init__(self, name, field):
        self.name, self.metadata = name, field.metadata


def test_errors_of_the_system_anywhere_in_a_command_become_one_line(monkeypatch, tmp_path):
    from palpate.operations.devices import devices

    for error, words in (
        (OSError(28, "No space left on device", "/x/y"), "'/x/y' cannot be used (No space left on device)"),
        (MemoryError(), "not enough memory"),
        (KeyboardInterrupt(), "interrupted"),
    ):

        def fail(*_, error=error, **__):
            raise error

        monkeypatch.setattr(devices.operation, "run", fail)
        code, said = command("devices")
        assert code == (130 if isinstance(error, KeyboardInterrupt) else 2)
        assert words in said and len(said.strip().splitlines()) == 1
