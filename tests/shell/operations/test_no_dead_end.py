"""What is refused says how to go on with the same file: the command is there and gets further."""

from __future__ import annotations

import ast
import importlib
import re
import shlex
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

import palpate as pp
import palpate.show
from palpate.cli import main
from palpate.mechanics.errors import ContactError, OptionError, RecordingError
from palpate.mechanics.recording.recording import write_recording
from palpate.mechanics.recording.segments import TimeSegment
from palpate.operations._list import OPERATIONS
from palpate.operations._run import parser_of
from palpate.operations._written import import_words, open_words
from palpate.reconstruction.checks.registry import looked_at
from palpate.reconstruction.steps.s7_modulus.held_out import HeldOutErrors
from palpate.show import next_lines
from palpate.show.reconstruction.story import mending

from ...conftest import REPOSITORY, modules_of
from ...reconstruct.exploration_of_cylinder import explore_cylinder
from ...reconstruct.flat_ground import MODULUS_PA, TIP_M, raster
from ...support.faults import FAULTS
from ..importing.test_meaning import write

OF_OPEN = ("palpate.reconstruction.", "palpate.importing.", "palpate.mechanics.shape.flat_foot")
"""Modules whose refusals `palpate open` passes on."""
MENDED = (
    "force in grams", "position in inches", "time in ms", "force axes swapped",
    "position mirrored", "force sign flipped", "rate said a tenth",
)  # fmt: skip
EVERYDAY = ("position in inches", "force axes swapped", "rate said a tenth")
FLAG = re.compile(r"(?<![\w-])--[a-z][a-z-]+")


def said_in(tree: ast.AST) -> list[str]:
    """The words of every error that is raised, names in them as X."""
    found = []
    for node in ast.walk(tree):
        if isinstance(node, ast.Raise) and node.exc is not None:
            parts = [
                each
                for each in ast.walk(node.exc)
                if isinstance(each, ast.Constant) and isinstance(each.value, str)
            ]
            found.append(" ".join(str(part.value) for part in parts))
    return found


def strings_of(tree: ast.AST) -> list[str]:
    """Every text of a module that is not documentation, names in it as X."""
    found = []
    inside = {id(part) for node in ast.walk(tree) if isinstance(node, ast.JoinedStr) for part in node.values}
    documentation = {id(node.value) for node in ast.walk(tree) if isinstance(node, ast.Expr)}
    for node in ast.walk(tree):
        if isinstance(node, ast.JoinedStr):
            found.append("".join(str(getattr(part, "value", "X")) for part in node.values))
        elif isinstance(node, ast.Constant) and isinstance(node.value, str):
            found += [node.value] if id(node) not in inside | documentation else []
    return found


def flags_of(command: str) -> set[str]:
    return {flag for action in parser_of(command)._actions for flag in action.option_strings}


@pytest.fixture(scope="module")
def sources() -> dict[str, str]:
    return {name: path.read_text(encoding="utf-8") for name, path in modules_of(REPOSITORY).items()}


def test_a_command_that_is_named_is_there_and_takes_the_flags_named_with_it(sources):
    known = {command: flags_of(command) for command in OPERATIONS}
    named, met = re.compile(r"[`']palpate ([a-z][a-z-]*)([^`']*)[`']"), 0
    for module, text in sources.items():
        for words in strings_of(ast.parse(text)):
            for command, rest in named.findall(words):
                if command == "bench":  # which hands its words on
                    continue
                assert command in known, f"{module}: no command {command}"
                for flag in FLAG.findall(rest):
                    met += 1
                    assert flag in known[command], f"{module}: palpate {command} does not take {flag}"
    assert met > 15


def test_open_takes_every_flag_that_a_refusal_of_it_names(sources):
    taken, met = flags_of("open"), set()
    for module, text in sources.items():
        if module.startswith(OF_OPEN):
            for words in said_in(ast.parse(text)):
                met |= {(flag, module) for flag in FLAG.findall(words)}
    assert {"--slab", "--shape", "--half-space", "--poisson-ratio", "--sink", "--rate"} <= {f for f, _ in met}
    assert not [each for each in met if each[0] not in taken]


@pytest.mark.parametrize(
    "words",
    [
        "diagnose REC.csv",
        "explore --robot --continue REC.csv -o more.csv --tip-radius 0.004",
        "reconstruct REC.csv -o M",
    ],
)
def test_what_is_not_traced_is_told_no_flag_that_the_command_has_not(words, tmp_path, monkeypatch, capsys):
    """It said --shape FILE, of a diagnosis too: "'--shape' is not an option; did you mean --seed?"."""
    monkeypatch.chdir(tmp_path)
    raster((3, 3)).save("REC.csv")
    assert main(words.split()) == 2
    said = capsys.readouterr().err
    quoted = re.compile(r"`palpate ([a-z]+)([^`]*)`")
    assert {flag for _, rest in quoted.findall(said) for flag in FLAG.findall(rest)} >= {"--shape", "--slab"}
    for command, rest in quoted.findall(said):
        assert set(FLAG.findall(rest)) <= flags_of(command)
    assert set(FLAG.findall(quoted.sub("", said))) <= flags_of(words.split()[0])
    assert "[object]" in said, "what holds for every command"


@pytest.fixture
def reached(monkeypatch) -> type[Exception]:
    """What is raised where a command comes to the reconstruction."""

    class Reached(Exception):
        pass

    def reconstruct(*_, **__):
        raise Reached

    importlib.import_module("palpate.diagnosis.compare.comparison")  # keeps what it is imported with
    monkeypatch.setattr("palpate.reconstruction.pipeline.reconstruct_fully", reconstruct)
    return Reached


@pytest.mark.parametrize(
    "fault", [pytest.param(f, marks=[pytest.mark.release] * (f not in EVERYDAY)) for f in MENDED]
)
def test_a_grave_finding_is_gone_by_a_way_that_it_names(fault, tmp_path, reached):
    recording = FAULTS[fault].change(explore_cylinder()[0], np.random.default_rng(0))
    file = write_recording(tmp_path / "wrong.csv", recording)
    try:
        said = "\n".join(next_lines(pp.open(str(file), progress=False).result))
    except RecordingError as error:
        said = str(error)
    words = shlex.split(re.search(r"palpate open [^'\n]*", said)[0])
    with pytest.raises(reached):
        main([*words[1:], "--report", "none"])


def words_with(recording, way, folder) -> list[str]:
    """The command of a way for a recording, as one would type it."""
    file = write_recording(folder / "wrong.csv", recording)
    return shlex.split(open_words({"files": (str(file),)}, way.options))[1:]


@pytest.mark.parametrize(
    "fault",
    [pytest.param(f, marks=[pytest.mark.release] * (f not in ("gaps", "rate said a tenth"))) for f in FAULTS],
)
def test_every_command_that_a_refused_file_is_told_gets_further(fault, tmp_path, reached, capsys):
    """To the reconstruction; a file that is to be named stays aside."""
    wrong = FAULTS[fault].change(explore_cylinder()[0], np.random.default_rng(0))
    file = str(write_recording(tmp_path / "wrong.csv", wrong))
    try:
        code = main(["open", file, "--report", "none"])
    except reached:
        return
    assert code in (1, 2)
    said = capsys.readouterr()
    told = re.findall(r"palpate (open [^'\n`]*)", said.out + said.err)
    if not told:
        assert code == 2 and re.search(r" must be |mend the clock", said.err), "no other meaning mends it"
    for command in (each for each in told if "SHAPE.stl" not in each):
        try:
            code = main([*shlex.split(command), "--report", "none"])
        except reached:
            continue
        # ten times too large is no unit: read as the nearest one, it is checked, and says what is wrong
        assert fault == "position x 10" and code == 1 and "GRAVE" in capsys.readouterr().out


def two_presses():
    """Of an exploration that was broken off."""
    whole, onsets = explore_cylinder()
    few = whole.t < onsets[2] - 0.2
    return replace(
        whole, t=whole.t[few], position=whole.position[few], force_on_tool=whole.force_on_tool[few]
    )


def test_few_presses_are_told_what_they_suffice_for():
    """It said to press more, and nothing of what the presses that are there can tell."""
    (finding,) = (f for f in looked_at(two_presses())[0] if f.grave)
    assert finding.name == "no presses" and [w.options["least_palpations"] for w in finding.ways] == [2, 2]
    with pytest.raises(ContactError, match="--least-palpations 2"):
        pp.reconstruct(two_presses(), half_space=True, progress=False)


def test_an_exploration_that_was_broken_off_is_told_to_go_on(tmp_path, capsys):
    """Of a traced dome with two presses it said 'it is a slab', and nothing of --continue."""
    few = two_presses()
    start, end = few.boundary_phase
    stretches = (TimeSegment("trace", 0.0, end), TimeSegment("press", end + 0.001, float(few.t[-1])))
    file = str(write_recording(tmp_path / "mine.csv", replace(few, segments=stretches)))
    for words in (["check", file], ["reconstruct", file, "-o", str(tmp_path / "M")], ["diagnose", file]):
        assert main(words) in (1, 2)
        said = capsys.readouterr()
        assert f"--continue {file}" in said.out + said.err and "slab" not in said.out + said.err


def test_no_press_is_asked_to_exceed_what_no_sensor_tells():
    """'until the force is above 4.9e-05 N' was asked of a recording without noise."""
    noisy = two_presses()
    quiet = replace(noisy, force_on_tool=explore_cylinder(noise=1e-6)[0].force_on_tool[: len(noisy.t)])
    for recording, asked in ((noisy, True), (quiet, False)):
        with pytest.raises(ContactError, match="at more places") as refused:
            pp.reconstruct(replace(recording, force_noise_std_n=None), progress=False)
        assert (" mN" in str(refused.value)) == asked and "e-0" not in str(refused.value)


@pytest.mark.slow
def test_what_few_presses_are_told_gives_a_modulus(tmp_path, capsys):
    (finding,) = (f for f in looked_at(two_presses())[0] if f.grave)
    for way in finding.ways:
        assert main([*words_with(two_presses(), way, tmp_path), "--report", "none"]) in (0, 1)
        assert "modulus" in capsys.readouterr().out


def test_every_way_of_every_fault_is_a_command_that_open_takes(tmp_path):
    recording, parser = explore_cylinder()[0], parser_of("open")
    for fault in ("|force|", "dead force axis", "10 Hz", "force 200 ms late"):
        found, _ = looked_at(FAULTS[fault].change(recording, np.random.default_rng(0)))
        for finding in (f for f in found if f.grave):
            assert finding.ways, finding.name
            for way in finding.ways:
                words = open_words({"files": ("a b.csv",), "columns": {"fz": "-Load (N)"}}, way.options)
                assert parser.parse_args(shlex.split(words)[2:]).files == ["a b.csv"]


def robots_log(folder: Path, of_force: str = " [gf]", unit_n: float = 9.80665e-3) -> Path:
    """Presses on flat ground, no foot traced, in mm and a unit of force, with a driver's names."""
    recording = raster((4, 4))
    header = "stamp,tcp_px [mm],tcp_py [mm],tcp_pz [mm]," + ",".join(f"ft_{a}{of_force}" for a in "xyz")
    columns = [recording.t, 1e3 * recording.position, recording.force_on_tool / unit_n]
    return write(folder / "robot.csv", columns, header)


def test_a_log_without_a_foot_is_told_the_commands_that_go_on_with_it(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    robots_log(tmp_path)
    assert main(["open", "robot.csv", "--tip-radius", str(TIP_M)]) == 1
    commands = re.findall(r"palpate open robot.csv.*", capsys.readouterr().out)
    assert len(commands) == 3
    for command, flag in zip(commands, ("--shape", "--slab", "--half-space"), strict=True):
        assert f"--tip-radius {TIP_M:g}" in command and flag in command
        assert parser_of("open").parse_args(shlex.split(command)[2:])
    page = (tmp_path / "robot-palpate.html").read_text()
    assert all(f"--tip-radius {TIP_M:g} {flag}" in page for flag in ("--shape", "--slab", "--half-space"))


def test_a_table_that_was_opened_can_be_left_behind_as_the_recording_that_it_was_taken_for(
    tmp_path, monkeypatch
):
    """A diagnosis of REC was proposed, and no recording was there."""
    monkeypatch.chdir(tmp_path)
    robots_log(tmp_path)
    given = {"files": ("robot.csv",), "save": "MODEL", "tip_radius_m": TIP_M, "slab_m": 0.3, "unit": "mm"}
    assert main(shlex.split(import_words(given, "REC.csv.gz"))[1:]) == 0
    left = pp.read_recording("REC.csv.gz")
    assert left.tip_radius_m == TIP_M and left.description["object"]["slab_m"] == 0.3


@pytest.mark.slow
def test_the_command_that_is_told_reaches_the_truth(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    robots_log(tmp_path)
    main(["open", "robot.csv", "--tip-radius", str(TIP_M), "--report", "none"])
    (command,) = [c for c in re.findall(r"palpate open robot.csv.*", capsys.readouterr().out) if "half" in c]
    assert main([*shlex.split(command)[1:], "--report", "none"]) == 0
    said = capsys.readouterr().out
    assert float(re.search(r"modulus ([\d.]+) kPa", said)[1]) == pytest.approx(MODULUS_PA / 1e3, rel=0.05)
    # no folder was written, so none is named as if it were there
    assert "palpate touch MODEL" not in said or "--output MODEL" in said
    assert "palpate import robot.csv" in said, "it leaves the recording that is to be diagnosed"


def test_a_unit_that_nobody_said_is_asked_about_before_a_modulus_is_told(tmp_path, monkeypatch, capsys):
    """1606 kPa for 16, exit 0, and the doubt in a note below it: of a stated geometry any force may be."""
    monkeypatch.chdir(tmp_path)
    robots_log(tmp_path, of_force="", unit_n=1e-3)
    words = ["open", "robot.csv", "--tip-radius", str(TIP_M), "--half-space", "--report", "none"]
    assert main(words) == 2
    said = capsys.readouterr()
    assert "Young's modulus" not in said.out
    assert "look like" in said.err and "--units force=mN or --units force=N" in said.err


@pytest.mark.slow
def test_what_does_not_predict_is_kept_before_it_is_looked_into(tmp_path, monkeypatch, capsys):
    """A diagnosis by MODEL was proposed, and no MODEL was there."""
    monkeypatch.chdir(tmp_path)
    robots_log(tmp_path)
    monkeypatch.setattr(HeldOutErrors, "doubt", "the model does not predict")
    assert main([*shlex.split(f"open robot.csv --half-space --report none --tip-radius {TIP_M}")]) == 1
    said = capsys.readouterr().out.partition("next:")[2]
    commands = [line.strip() for line in said.splitlines() if line.strip().startswith("palpate ")]
    assert [c.split()[1] for c in commands] == ["open", "import", "diagnose"], "a line each, to be pasted"
    assert "--output MODEL" in commands[0] and "--model MODEL" in commands[2]


def test_a_shape_whose_model_does_not_predict_is_tried_another_way_up():
    """Upside down it said 42 kPa for 17, and nothing of --up."""
    result = SimpleNamespace(
        placed=SimpleNamespace(doubt="", likelier_radius_m=None, about={"file": "part.stl"}),
        doubt="a 1D model predicts better",
        held_out=None,
        model=SimpleNamespace(
            provenance={"options": {"geometry": {"up": "+z"}, "modulus_field": {"field": "auto"}}}
        ),
    )
    (way,) = mending(result)
    words = open_words({"files": ("REC.csv",), "shape": "part.stl", "unit": "mm"}, way.options)
    parsed = parser_of("open").parse_args(shlex.split(words)[2:])
    assert parsed.up == "-z" and parsed.shape == "part.stl"
    result.placed.doubt, result.placed.likelier_radius_m = "the tip's radius may not be 6.2 mm", 0.0031
    (way,) = mending(result)
    words = open_words({"files": ("REC.csv",), "shape": "part.stl", "tip_radius_m": 0.0062}, way.options)
    parsed = parser_of("open").parse_args(shlex.split(words)[2:])
    assert parsed.tip_radius_m == pytest.approx(0.0031) and parsed.shape == "part.stl"


def test_a_geometry_that_is_named_takes_the_place_of_force():
    words = open_words({"files": ("REC.csv",), "half_space": True, "force": True}, {"shape": "SHAPE.stl"})
    assert words == "palpate open REC.csv --shape SHAPE.stl"


def test_what_says_nothing_of_such_a_file_is_refused(tmp_path):
    trimesh = pytest.importorskip("trimesh")
    trimesh.creation.box((40, 40, 20)).export(tmp_path / "box.stl")
    with pytest.raises(OptionError, match="--slab"):
        pp.open(tmp_path / "box.stl", slab_m=0.02, progress=False)
