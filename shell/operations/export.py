"""A MODEL for other programs: a minimal scene that runs there, its mesh, or a page that can be pressed.

mujoco (.xml): a flex on its base and a sphere on driven slides. sofa (.scn): tetrahedra, base, a sphere's
force. abaqus (.inp): hybrid tetrahedra, base, a rigid sphere that is pressed in. gmsh (.msh): mesh, groups,
moduli. usd (.usda): a deformable TetMesh with its material, base and tip. newton, drake (.py): scripts that
press. stl: the boundary. page (.html): one file that any browser opens, offline, in which the object can be
pressed. Metres, newtons, pascals, the model's frame (an STL's lengths as --unit says).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import KW_ONLY, dataclass
from pathlib import Path
from typing import TYPE_CHECKING

from palpate.exporting.registry import FORMATS
from palpate.operations._declare import REQUIRED, Call, operand, operation
from palpate.operations._shared import model_operand
from palpate.operations._to_argparse import vector
from palpate.operations.load import load
from palpate.output import Output

if TYPE_CHECKING:
    from palpate.operations._shared import ModelLike


@dataclass(frozen=True)
class ExportOperands:
    """What is written, for which program."""

    model: ModelLike = model_operand("folder of a model, or a scene")
    to: str = operand(REQUIRED, "the program", choices=tuple(FORMATS))
    path: str | Path = operand(REQUIRED, "file to write", flag="--output", short="-o", metavar="PATH")
    _: KW_ONLY
    at: Sequence[float] | None = operand(
        None,
        "where the scene's tip presses, (3,); None: middle of the top",
        unit="m",
        metavar="X,Y,Z",
        parse=vector,
    )
    depth_m: float | None = operand(None, "how deep; None: half the tip's radius", unit="m")
    unit: str = operand("m", "of an STL's lengths", metavar="UNIT")


def _answer(notes: tuple[str, ...], asked: ExportOperands, out: Output) -> int:
    opened = FORMATS[asked.to].opened_by.replace("`", "").format(path=asked.path)
    out.say(f"written for {asked.to}: {asked.path}", *(f"  {note}" for note in notes), f"next: {opened}")
    out.json({"to": asked.to, "path": asked.path, "notes": list(notes)})
    return 0


@operation(ExportOperands, answer=_answer)
def export(asked: ExportOperands, call: Call) -> tuple[str, ...]:
    """Write a model for another program: a minimal scene that runs there, its mesh, or a page to be pressed.

    Returns what the format cannot say, one line each. But for an STL's lengths all is in SI units, m, and the
    model's frame. Raises OptionError for an unknown format or a place that misses the object, FileError where
    the file cannot be written.
    """
    import numpy as np

    from palpate.exporting.registry import write

    plain = load(asked.model, progress=call.wanted)
    at = None if asked.at is None else np.asarray(asked.at)
    with call.progress("export") as tell:
        return write(
            plain, asked.to, asked.path, at=at, depth_m=asked.depth_m, unit=asked.unit, progress=tell
        )
