"""What several operations take: recordings, models, a surface's file, seeds, reports; each declared once."""

from __future__ import annotations

import warnings
from argparse import ArgumentTypeError
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

from palpate.mechanics.contact.tip import FORMS
from palpate.mechanics.disk.surface_files import UNITS, is_surface_file
from palpate.mechanics.errors import OptionError, PalpateWarning
from palpate.mechanics.names import number, pairs
from palpate.mechanics.plausible import EXPLORATION, PART_MODULUS, YOUNG_MODULUS
from palpate.operations._declare import argument, option
from palpate.operations._to_argparse import finite, natural
from palpate.render.registry import names, simulator_names

if TYPE_CHECKING:
    import palpate.mechanics.model.model
    import palpate.mechanics.recording.recording
    from palpate.reconstruction.pipeline import Reconstruction
    from palpate.render.options import RenderOptions
    from palpate.scenes.laboratory.simulate import Simulation
    from palpate.scenes.scene import Scene

    RecordingLike = str | Path | palpate.mechanics.recording.recording.Recording | Simulation
    ModelLike = str | Path | palpate.mechanics.model.model.Model | Reconstruction | Scene

PAGE = "palpate.show.page:PAGE"
MODEL = "palpate.mechanics.model.files:MODEL"
SAMPLES = "palpate.mechanics.recording.files:SAMPLES"


def _split(text: str) -> list[str]:
    return text.split(",") if text else []


RecordingArgument = Annotated[
    "RecordingLike",
    argument("recording: .csv, .csv.gz, .toml, or an embedded one's name", metavar="REC", reads=True),
]
"""In Python also what `read_recording` or `simulate` returned."""
Seed = Annotated[int, option("seed of every random choice", low=0, high=2**63 - 1, parse=natural)]
Renders = Annotated[str, option("which renderer computes the force", choices=(*names(), *simulator_names()))]
"""A renderer: ours, or another simulator."""


def units_option(*, advanced: bool = False) -> Mapping[str, Any]:
    """--units; in Python {kind: unit}."""
    words = "units of the columns; kinds: position, force, time"
    return option(words, metavar="KIND=UNIT,...", parse=_split, advanced=advanced)


Units = Annotated["Mapping[str, str] | None", units_option()]
TipForm = Annotated[
    str | None,
    option(
        "form of a machine's tip; None: as the file says, else a sphere where the curves allow it",
        choices=FORMS,
    ),
]
"""A sphere and a flat punch have a radius, the others an angle."""
TipAngle = Annotated[
    float | None,
    option("half angle of a cone or pyramid, axis to flank", unit="deg", flag="--tip-angle"),
]
ClockOfRows = Annotated[
    str | None,
    option(
        "if time goes back: one clock, or blocks with a clock each", choices=("one", "blocks"), advanced=True
    ),
]
"""Whether a log's times are of one clock."""


def model_argument(words: str = "folder of a model, a scene, a surface file") -> Mapping[str, Any]:
    """MODEL_OR_SCENE, which is read; in Python also what `load` or `reconstruct` returned, or a renderer."""
    return argument(words, metavar="MODEL_OR_SCENE", reads=True)


def report_option(words: str, **more: Any) -> Mapping[str, Any]:
    """--report HTML, on the command line alone: the results of Python calls have a method of that name."""
    return option(words, metavar="HTML", writes=PAGE, only="command", **more)


def output_option(words: str, metavar: str, writes: Any) -> Mapping[str, Any]:
    """-o PATH, on the command line alone: the results of Python calls have the method `save`."""
    return option(words, metavar=metavar, writes=writes, short="-o", only="command", flag="--output")


def save_option(words: str, metavar: str, writes: Any, *, needed: bool = False) -> Mapping[str, Any]:
    """-o PATH, which Python calls take as `save`. needed: on the command line."""
    return option(words, flag="--output", short="-o", metavar=metavar, writes=writes, needed=needed)


def columns_option(roles: str, **more: Any) -> Mapping[str, Any]:
    """--column ROLE=NAME, repeatable; in Python {role: name}."""
    words = f"which column has which role (repeatable): {roles}"
    return option(words, flag="--column", metavar="ROLE=NAME", count="repeat", **more)


def seconds(text: str, flag: str) -> float:
    """A number of seconds that was typed; raises OptionError for no finite one."""
    try:
        return finite(text)
    except (ValueError, ArgumentTypeError) as error:
        raise OptionError(f"{flag}: '{text}' is no finite number of seconds") from error


def offset_option() -> Mapping[str, Any]:
    """--offset, of two files with a clock each."""
    words = "offset of the force's clock, or auto (cross-correlation)"
    return option(words, unit="s", metavar="NUMBER", parse=_offset, advanced=True)


def _offset(text: str) -> float | str:
    return text if text == "auto" else seconds(text, "--offset")


def modulus_option() -> Mapping[str, Any]:
    """--modulus PA, or NAME=PA of each part of a mesh; in Python a number, or {part: Pa, '': of the
    others}."""
    words = "Young's modulus; of a mesh's parts NAME=PA (repeatable; 0: left out); None: 20000, of one part"
    return option(words, unit="Pa", flag="--modulus", metavar="PA", count="repeat", parse=str)


def moduli(given: Any) -> Any:
    """A number or {part: Pa} of what was said by `modulus_option`, None of nothing. Raises OptionError for
    what is no modulus."""
    if isinstance(given, list):
        flag = "--modulus"
        named: dict[str, float] = {}
        for word in given:
            name, equals, value = str(word).rpartition("=")
            if name in named:
                raise OptionError(f"{flag} is said twice{f' of {name}' if name else ''}: say it once")
            named[name] = number(flag, name, value) if equals else _plain(word)
        given = named[""] if set(named) == {""} else named
    for name, value in given.items() if isinstance(given, Mapping) else [("", given)]:
        of = f" of {name}" if name else ""
        allowed = PART_MODULUS if name else YOUNG_MODULUS
        if value is not None and not allowed.takes(value):
            raise OptionError(f"--modulus{of} is {value!r}; it must be {allowed.words}")
        if value:
            warn_of_modulus(float(value), f"--modulus{of}", "--modulus ")
    return given


def warn_of_modulus(modulus_pa: float, what: str, flag: str) -> None:
    """Warn of a modulus in Pa that no hand feels, with the one that may be meant."""
    usual = EXPLORATION["modulus"]
    if usual.low <= modulus_pa <= usual.high:
        return
    kilo = 1e3 * modulus_pa
    meant = f"in kPa? Then {flag}{kilo:g}" if usual.low <= kilo <= usual.high else "is it in Pa?"
    odd = f"{modulus_pa:g} Pa; soft objects have {usual.low:g} to {usual.high:g} Pa: {meant}"
    warnings.warn(f"{what} is {odd}", PalpateWarning, stacklevel=1)


def _plain(word: str) -> float:
    try:
        return float(word)
    except ValueError:
        raise OptionError(f"--modulus is '{word}'; it must be a number in Pa, or NAME=PA of a part") from None


_UNIT = option("unit of the file's lengths", choices=tuple(UNITS))
_UP = option("direction out of the support: +z, -x, ... or X,Y,Z", metavar="AXIS")
_SINK = option("height that is cut off flat at the bottom", unit="m")


@dataclass(frozen=True)
class MeshFileOptions:
    """How a surface's file (STL, OBJ, PLY, glTF, VTP, VTU, MSH, INP) is meant, where one is the object."""

    title = "a surface's file as the object"

    young_modulus_pa: float | Mapping[str, float] | None = field(default=None, metadata=modulus_option())
    poisson_ratio: float | None = field(
        default=None, metadata=option("Poisson's ratio; None: 0.49", flag="--nu")
    )
    unit: str = field(default="m", metadata=_UNIT)
    up: str = field(default="+z", metadata=_UP)
    sink_m: float = field(default=0.0, metadata=_SINK)


@dataclass(frozen=True)
class PhantomFileOptions:
    """How a surface's file is meant, where one is the phantom."""

    title = "a surface's file as the phantom"

    unit: str = field(default="m", metadata=_UNIT)
    up: str = field(default="+z", metadata=_UP)
    sink_m: float = field(default=0.0, metadata=_SINK)


_FLAGS = {"young_modulus_pa": "modulus", "poisson_ratio": "nu", "sink_m": "sink", "columns": "column"}
_OF_A_FILE = ("unit", "up", "sink_m")


def _meant(said: Mapping[str, Any]) -> dict[str, Any]:
    """What was said of a surface's file, by field of a scene. Raises OptionError for no modulus."""
    given = {name: value for name, value in said.items() if value is not None}
    if "young_modulus_pa" in given:
        given["young_modulus_pa"] = moduli(given["young_modulus_pa"])
    return given


def given_scene(name: str | Path, said: Mapping[str, Any]) -> Scene:
    """The scene of a name or path, as what was said of a surface's file (MeshFileOptions) means it.

    Raises OptionError for a unit or direction of what is no surface's file.
    """
    from palpate.scenes.scene import load_scene

    scene, changes = load_scene(name), _meant(said)
    wrong = [key for key in _OF_A_FILE if key in changes and scene.kind != "mesh"]
    if wrong:
        flag = _FLAGS.get(wrong[0], wrong[0])
        raise OptionError(f"--{flag} is for the file of a surface; '{name}' is a {scene.kind}")
    return replace(scene, **changes)


def given_model(model: Any, said: Mapping[str, Any], flag: str = "--model") -> Any:
    """What `load` is to load: a scene for a surface's file or where something of it was given, else what was
    given. Raises OptionError where something is said of a surface that is not there."""
    flags = [_FLAGS.get(key, key) for key in _meant(said)]
    if not isinstance(model, str | Path):
        if flags:
            raise OptionError(f"--{flags[0]} needs {flag} FILE: the surface that it is about")
        return model
    return given_scene(model, said) if flags or is_surface_file(Path(model)) else model


def names_scene(model: Any) -> bool:
    """Whether what is touched is a scene, not an object by itself: a MODEL, a recording, a surface's file."""
    from palpate.scenes.scene import Scene, load_scene

    if not isinstance(model, str | Path):
        return isinstance(model, Scene)
    scene = load_scene(model)
    return scene.kind == "phantom" or Path(scene.source) != Path(model).resolve()


def with_friction(options: RenderOptions, scene: Scene) -> RenderOptions:
    """The renderers' options with the scene file's friction, where they have none of their own."""
    return options if options.friction is not None else replace(options, friction=scene.friction)


def named(given: Any, flag: str) -> dict[str, str]:
    """{name: value} of NAME=VALUE words, or of what is such a mapping already; raises OptionError."""
    example = {"columns": "t=Time", "units": "position=mm"}[flag]
    return dict(pairs(given, f"--{_FLAGS.get(flag, flag)}", example))
