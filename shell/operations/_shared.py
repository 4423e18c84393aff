"""What several operations take: recordings, models, a surface's file, seeds, reports; each declared once."""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

from palpate.mechanics.disk.surface_files import UNITS, is_surface_file
from palpate.mechanics.errors import OptionError
from palpate.mechanics.names import pairs
from palpate.operations._declare import REQUIRED, Call, operand
from palpate.operations._to_argparse import natural
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


def recording_operand(
    default: Any = REQUIRED,
    words: str = "recording: .csv, .csv.gz, .toml, or an embedded one's name",
    **more: Any,
) -> Any:
    """REC, which is read; in Python also what `read_recording` returned, or an embedded name."""
    return operand(default, words, metavar="REC", positional=True, reads=True, **more)


def model_operand(words: str = "folder of a model, a scene, a surface file") -> Any:
    """MODEL_OR_SCENE, which is read; in Python also what `load` or `reconstruct` returned, or a renderer."""
    return operand(REQUIRED, words, metavar="MODEL_OR_SCENE", positional=True, reads=True)


def model_flag(words: str) -> Any:
    """--model MODEL, which is read."""
    return operand(None, words, metavar="MODEL", reads=True)


def seed_operand() -> Any:
    """--seed N."""
    return operand(0, "seed of every random choice", low=0, high=2**63 - 1, parse=natural)


def report_operand(words: str, **more: Any) -> Any:
    """--report HTML, on the command line alone: the results of Python calls have a method of that name."""
    return operand(None, words, metavar="HTML", writes=PAGE, only="command", **more)


def output_operand(words: str, metavar: str, writes: Any, default: Any = None, **more: Any) -> Any:
    """-o PATH, on the command line alone: the results of Python calls have the method `save`."""
    return operand(
        default, words, metavar=metavar, writes=writes, short="-o", only="command", flag="--output", **more
    )


def save_operand(words: str, metavar: str, writes: Any, *, needed: bool = False) -> Any:
    """-o PATH, which Python calls take as `save`. needed: on the command line."""
    return operand(None, words, flag="--output", short="-o", metavar=metavar, writes=writes, needed=needed)


def tip_radius_operand(words: str, default: float | None = None, **more: Any) -> Any:
    """--tip-radius, m."""
    return operand(default, words, unit="m", **more)


def poisson_operand(words: str, default: float | None = None, **more: Any) -> Any:
    """--poisson-ratio; the range is asked where the number is used."""
    return operand(default, words, **more)


def renderer_operand() -> Any:
    """--renderer NAME, ours or another simulator."""
    return operand("fem", "what answers", choices=(*names(), *simulator_names()))


@dataclass(frozen=True)
class MeshFileOptions:
    """How a surface's file (STL, OBJ, PLY, glTF, VTP, VTU, MSH, INP) is meant, where one is the object."""

    title = "a surface's file as the object"

    young_modulus_pa: float | None = operand(
        None, "Young's modulus; None: 20000", unit="Pa", flag="--modulus"
    )
    poisson_ratio: float | None = operand(None, "Poisson's ratio; None: 0.49", flag="--nu")
    unit: str = operand("m", "of the file's lengths", choices=tuple(UNITS))
    up: str = operand("+z", "out of the support: +z, -x, ... or X,Y,Z", metavar="AXIS")
    sink_m: float = operand(0.0, "cut off flat at the bottom", unit="m")


_FLAGS = {"young_modulus_pa": "modulus", "poisson_ratio": "nu", "sink_m": "sink", "columns": "column"}
_OF_A_FILE = ("unit", "up", "sink_m")


def _meant(call: Call) -> dict[str, Any]:
    """What was said of a surface's file, by field of a scene. Raises OptionError for no modulus."""
    given = {name: value for name, value in call.values(MeshFileOptions).items() if value is not None}
    if not given.get("young_modulus_pa", 1.0) > 0:
        raise OptionError(f"--modulus is {given['young_modulus_pa']} Pa; it must be greater than 0")
    return given


def given_scene(name: str | Path, call: Call) -> Scene:
    """The scene of a name or path, as the options mean it.

    Raises OptionError for a unit or direction of what is no surface's file.
    """
    from palpate.scenes.scene import load_scene

    scene, changes = load_scene(name), _meant(call)
    wrong = [key for key in _OF_A_FILE if key in changes and scene.kind != "mesh"]
    if wrong:
        flag = _FLAGS.get(wrong[0], wrong[0])
        raise OptionError(f"--{flag} is for the file of a surface; '{name}' is a {scene.kind}")
    return replace(scene, **changes)


def given_model(model: Any, call: Call, flag: str = "--model") -> Any:
    """What `load` is to load: a scene for a surface's file or where something of it was given, else what was
    given. Raises OptionError where something is said of a surface that is not there."""
    said = [_FLAGS.get(key, key) for key in _meant(call)]
    if not isinstance(model, str | Path):
        if said:
            raise OptionError(f"--{said[0]} needs {flag} FILE: the surface that it is about")
        return model
    return given_scene(model, call) if said or is_surface_file(Path(model)) else model


def with_friction(options: RenderOptions, scene: Scene) -> RenderOptions:
    """The renderers' options with the scene file's friction, where they have none of their own."""
    return options if options.friction is not None else replace(options, friction=scene.friction)


def columns_operand(roles: str, **more: Any) -> Any:
    """--column ROLE=NAME, repeatable; in Python {role: name}."""
    return operand(
        None,
        f"of which role is which column (repeatable): {roles}",
        flag="--column",
        metavar="ROLE=NAME",
        count="repeat",
        **more,
    )


def units_operand() -> Any:
    """--units KIND=UNIT,...; in Python {kind: unit}."""
    return operand(None, "kinds: position, force, time", metavar="KIND=UNIT,...", parse=_split)


def _split(text: str) -> list[str]:
    return text.split(",") if text else []


def named(given: Any, flag: str) -> dict[str, str]:
    """{name: value} of NAME=VALUE words, or of what is such a mapping already; raises OptionError."""
    example = {"columns": "t=Time", "units": "position=mm"}[flag]
    return dict(pairs(given, f"--{_FLAGS.get(flag, flag)}", example))
