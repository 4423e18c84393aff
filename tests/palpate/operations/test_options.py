"""Every option of a function reaches the room below; what is no option is told in one clear error."""

from __future__ import annotations

import dataclasses
import inspect
from collections.abc import Iterator
from contextlib import contextmanager
from types import SimpleNamespace

import pytest

import palpate as pp
import render.press
import render.replay  # noqa: F401
from palpate.keywords import FUNCTIONS, kinds

from ...render import shapes


class Reached(Exception):
    """The room was called; holds the options that it was given, by dataclass."""


@pytest.fixture
def rooms(monkeypatch):
    """Every room's function says what options it was called with, and does nothing else."""

    def listening(*arguments, **keywords):
        raise Reached([v for v in (*arguments, *keywords.values()) if dataclasses.is_dataclass(v)])

    for name in (
        "reconstruct.pipeline.reconstruct_fully",
        "diagnose.compare.comparison.compare",
        "diagnose.pipeline.diagnose",
        "scenes.laboratory.simulate.simulate",
    ):
        monkeypatch.setattr(name, listening)
    rendered = []

    def created(name, model, options, tell):
        rendered.append(options)
        return SimpleNamespace(model=SimpleNamespace(path=None))

    monkeypatch.setattr("render.registry.create", created)
    monkeypatch.setattr("render.scene.scene_of", lambda made, support: listening(*rendered, support))
    monkeypatch.setattr("reconstruct.placing.presses_on", lambda recording, model: model.presses)


def call(name, recording, **options):
    block = shapes.model(shapes.block((0.06, 0.06, 0.03), (2, 2, 1)))
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
    every = pp.options(name)
    assert every
    homes = {f.name: kind for kind in kinds(name) for f in dataclasses.fields(kind) if f.metadata}
    for option in every:
        with room_is_reached() as found:
            call(name, recording, **{option.name: other(option)})
        assert getattr(found[homes[option.name]], option.name) == other(option), option.name


@pytest.mark.parametrize("name", FUNCTIONS)
def test_options_have_one_name_each_that_no_argument_shadows_unless_it_is_the_same(name):
    names = [option.name for option in pp.options(name)]
    assert len(names) == len(set(names))
    shared = set(names) & set(inspect.signature(getattr(pp, name)).parameters)
    assert shared <= {"method", "fast", "seed"}
    assert all(option.help in str(pp.options(name)) for option in pp.options(name))


@pytest.mark.parametrize("name", FUNCTIONS)
def test_what_is_no_option_is_told_before_any_work(name, recording, rooms):
    with pytest.raises(pp.OptionError, match=f"pp.{name} has no option 'mesh_siz': .*allowed are"):
        call(name, recording, mesh_siz=0.01)


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
    with pytest.raises(pp.OptionError, match="has no options; allowed are reconstruct"):
        pp.options("load")


def test_a_renderer_keeps_its_own_options(felt, recording):
    with pytest.raises(pp.OptionError, match="friction: a renderer that is there keeps its options"):
        pp.replay(felt, recording, friction=0.5)
    with pytest.raises(pp.OptionError, match="'rem' is no renderer; allowed are fem"):
        pp.renderer(felt.model, "rem", progress=False)
