"""Every option of a function reaches the room below; what is no option is told in one clear error."""

from __future__ import annotations

import argparse
import dataclasses
import inspect
from collections.abc import Iterator
from contextlib import contextmanager
from functools import cache
from types import SimpleNamespace

import pytest

import palpate as pp
import palpate.render.press
import palpate.render.replay
from palpate.diagnosis.other_simulator.forces import ForcesOptions
from palpate.operations._declare import check_options, declared, operation_of, written
from palpate.operations._list import OPERATIONS, calls
from palpate.operations._run import command_operation, parser_of
from palpate.operations._shared import MeshFileOptions, PhantomFileOptions

from ...render import shapes

FUNCTIONS = (
    "reconstruct",
    "renderer",
    "replay",
    "press",
    "compare",
    "diagnose",
    "changes",
    "calibrate",
    "simulate",
)


class Reached(Exception):
    """The room was called; holds the options that it was given, by dataclass."""


@pytest.fixture
def rooms(monkeypatch):
    """Every room's function says what options it was called with, and does nothing else."""

    def listening(*arguments, **keywords):
        raise Reached([v for v in (*arguments, *keywords.values()) if dataclasses.is_dataclass(v)])

    for name in (
        "palpate.reconstruction.pipeline.reconstruct_fully",
        "palpate.diagnosis.compare.comparison.compare",
        "palpate.diagnosis.pipeline.diagnose",
        "palpate.diagnosis.other_simulator.pipeline.diagnose_simulated",
        "palpate.scenes.laboratory.simulate.simulate",
    ):
        monkeypatch.setattr(name, listening)
    rendered = []

    def created(name, model, options, tell, **_):
        rendered.append(options)
        return SimpleNamespace(model=SimpleNamespace(path=None))

    monkeypatch.setattr("palpate.operations.renderer.create", created)
    monkeypatch.setattr("palpate.render.scene.scene_of", lambda made, support: listening(*rendered, support))
    monkeypatch.setattr(
        "palpate.reconstruction.presses_on_model.presses_on", lambda recording, model: model.presses
    )


@cache
def small_block():
    return shapes.model(shapes.block((0.06, 0.06, 0.03), (2, 2, 1)))


def call(name, recording, **options):
    block = small_block()
    arguments = {
        "reconstruct": (recording,),
        "renderer": (block,),
        "replay": (block, recording),
        "press": (block, (0, 0, 0.03)),
        "compare": (recording, block),
        "diagnose": (recording, block),
        "changes": (recording, recording),
        "calibrate": (recording,),
        "simulate": ("block",),
    }
    needed = {"calibrate": {"modulus_pa": 20e3}}.get(name, {})
    return getattr(pp, name)(*arguments[name], progress=False, **needed, **options)


def other(option):
    """A value that is allowed and not the default."""
    if option.choices:
        return next(c for c in option.choices if c != option.default)
    if isinstance(option.default, bool):
        return not option.default
    if isinstance(option.default, int):
        return option.default + 1
    if isinstance(option.default, str):
        return "adhesion"
    if option.name == "most":  # a number of effects, None by default
        return 2
    value = 0.4 if option.default is None else option.default * 0.5 + 1e-3
    return min(max(value, option.low), option.high)


def held(thing) -> Iterator[tuple[type, object]]:
    """An options dataclass and those inside it."""
    yield type(thing), thing
    for field in dataclasses.fields(thing):
        value = getattr(thing, field.name)
        if dataclasses.is_dataclass(value):
            yield from held(value)


@contextmanager
def room_is_reached():
    with pytest.raises(Reached) as reached:
        yield (found := {})
    for thing in reached.value.args[0]:
        found.update(dict(held(thing)))


@pytest.mark.parametrize("name", FUNCTIONS)
def test_every_option_reaches_its_room(rooms, recording, name):
    homes = {
        f.name: kind
        for kind in operation_of(name).kinds
        for f in declared(kind)
        if kind not in (MeshFileOptions, PhantomFileOptions) and f.name != "seed"
    }
    every = [option for option in pp.options(name) if option.name in homes]
    assert {option.name for option in every} == set(homes)
    for option in every:
        of_forces = homes[option.name] is ForcesOptions
        told = {"simulated": (recording.t, recording.force_on_tool)} if of_forces else {}
        with room_is_reached() as found:
            call(name, recording, **told, **{option.name: other(option)})
        assert getattr(found[homes[option.name]], option.name) == other(option), option.name


@pytest.mark.parametrize("name", calls())
def test_signature_help_and_list_show_every_option_with_its_default(name):
    function, listed = getattr(pp, name), pp.options(name)
    parameters = inspect.signature(function).parameters
    with_default = {
        n: p.default for n, p in parameters.items() if p.default is not p.empty and n != "progress"
    }
    assert {o.name: o.default for o in listed if o.name in with_default} == with_default
    assert {o.name for o in listed} - set(with_default) <= {"files"}, "what comes as *files has no default"
    assert all(option.help in str(listed) for option in listed)
    assert all(p.kind is not p.VAR_KEYWORD for p in parameters.values())
    words = inspect.getdoc(function)
    for option in listed:
        assert option.help in words
        assert not option.unit or f"{option.name} [{option.unit}]" in words


@pytest.mark.parametrize("name", calls())
def test_no_two_options_of_one_operation_share_a_name(name):
    """But for a seed that a room has too, which is the operation's."""
    operation = operation_of(name)
    names = [*operation.own, *(f.name for kind in operation.kinds for f in declared(kind))]
    twice = {n for n in names if names.count(n) > 1}
    assert twice <= {"seed", "young_modulus_pa"}


@pytest.mark.parametrize("name", [n for n, entry in OPERATIONS.items() if entry.command and entry.calls])
def test_a_command_and_its_call_take_the_same_names_defaults_and_needs(name):
    """But for a file to write that a command alone needs: a call hands its result back."""
    operation, _ = command_operation(name)
    of_all = ("help", "json", "log_level", argparse.SUPPRESS)
    flags = {a.dest: a for a in parser_of(name)._actions if a.dest not in of_all}
    parameters = dict(inspect.signature(getattr(pp, operation.name)).parameters)
    parameters.pop("progress", None)
    only = {n: written(f).only for n, f in operation.fields.items()}
    assert {n for n in flags if only[n] != "command"} == {n for n in parameters if only[n] != "python"}
    for each, parameter in parameters.items():
        field = operation.fields[each]
        if parameter.kind is parameter.VAR_POSITIONAL:
            assert flags[each].nargs in ("+", "*")
            continue
        needed = parameter.default is parameter.empty
        assert needed == (field.default is dataclasses.MISSING)
        assert needed or parameter.default == field.default
        if each in flags:
            assert flags[each].default is argparse.SUPPRESS or needed, "the one default is the field's"
            assert flags[each].required == needed or (each == "save" and written(field).needed)


@pytest.mark.parametrize("name", [n for n, entry in OPERATIONS.items() if entry.command])
def test_what_is_the_command_lines_alone_says_so(name):
    """What a call has no name for: files, pages, and what only a terminal needs."""
    operation, module = command_operation(name)
    alone = {n for n, f in operation.fields.items() if written(f).only == "command"}
    files = {n for n in alone if written(operation.fields[n]).writes or written(operation.fields[n]).reads}
    assert alone - files <= {
        "tolerance",
        "seal",
        "diagnosed",
        "name",
        "slab",
        "half_space",
        "dry_run",
        "full",
    }


@pytest.mark.parametrize("name", FUNCTIONS)
def test_what_is_no_option_is_told_before_any_work(name, recording, rooms):
    with pytest.raises(pp.OptionError, match=f"pp.{name} has no option 'mesh_siz': .*allowed are"):
        call(name, recording, mesh_siz=0.01)


@pytest.mark.parametrize(
    ("options", "words"),
    [
        ({"without": "adhesion, frction_slip"}, "'frction_slip' is no effect; did you mean friction_slip"),
        ({"renderer": "mujoco", "stated": ["frction=0.5"]}, "--stated frction: not known; allowed are young"),
        (
            {"renderer": "mujoco", "simulator_set": "solref=1"},
            "--simulator-set solref=1: allowed are cone",
        ),
        ({"renderer": "mujoco", "mended": "best,solref=1"}, "solref=1: allowed are cone"),
        ({"presses": 12}, "--presses says over how many a simulator is run: name it by --renderer"),
    ],
)
def test_a_misspelt_effect_or_parameter_is_told_before_a_model_is_made(recording, rooms, options, words):
    with pytest.raises(pp.OptionError, match=words):
        pp.diagnose(recording, progress=False, **options)
    if "without" in options:
        with pytest.raises(pp.OptionError, match=words):
            check_options("diagnose", options)  # as `batch` asks


def test_near_misses_and_wrong_kinds_are_told(recording, rooms):
    for options, words in (
        ({"mesh_size": 0.01}, "did you mean mesh_size_m"),
        ({"mesh_size_m": "10 mm"}, "mesh_size_m is '10 mm'; it must be a number in m"),
        ({"surface": "cube"}, "surface is 'cube'; allowed are"),
        ({"correct_delay": 1}, "correct_delay is 1; it must be True or False"),
        ({"bootstraps": 2.5}, "bootstraps is 2.5; it must be a whole number"),
    ):
        with pytest.raises(pp.OptionError, match=words):
            call("reconstruct", recording, **options)
    with pytest.raises(pp.OptionError, match="'lod' is no operation; did you mean load. allowed are check"):
        pp.options("lod")


def test_a_renderer_keeps_its_own_options(felt, recording):
    with pytest.raises(pp.OptionError, match="friction: a renderer that is there keeps its options"):
        pp.replay(felt, recording, friction=0.5)
    with pytest.raises(pp.OptionError, match="'rem' is no renderer; did you mean fem. allowed are fem"):
        pp.renderer(felt.model, "rem", progress=False)
