"""A MODEL or a recording for other programs: a minimal scene, its mesh, a page to press, a log to scrub.

mujoco (.xml): a flex on its base and a sphere on driven slides. sofa (.scn): tetrahedra, base, a sphere's
force. abaqus (.inp): hybrid tetrahedra, base, a rigid sphere that is pressed in. gmsh (.msh): mesh, groups,
moduli. usd (.usda): a deformable TetMesh with its material, base and tip. newton, drake (.py): scripts that
press. stl: the boundary. page (.html): one file that any browser opens, offline, in which the object can be
pressed. Metres, newtons, pascals, the model's frame (an STL's lengths as --unit says). Of a recording, with
--model also of what that model makes of it: mcap (.mcap), ROS 2's poses and wrenches; rerun (.rrd), object,
tip, force and residual over time.
"""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

from palpate.exporting.registry import FORMATS, RECORDED
from palpate.mechanics.errors import OptionError
from palpate.operations._call import Call
from palpate.operations._declare import operation, option
from palpate.operations._shared import model_argument, names_scene
from palpate.operations._to_argparse import vector
from palpate.operations.load import load

if TYPE_CHECKING:
    from palpate.operations._shared import ModelLike, RecordingLike


@operation()
def export(
    model: Annotated[
        ModelLike | RecordingLike,
        model_argument("folder of a model, or a scene; for mcap and rerun a recording"),
    ],
    to: Annotated[str, option("program or format to write for", choices=(*FORMATS, *RECORDED))],
    path: Annotated[str | Path, option("file to write", flag="--output", short="-o", metavar="PATH")],
    *,
    at: Annotated[
        Sequence[float] | None,
        option(
            "where the scene's tip presses, (3,); None: middle of the top",
            unit="m",
            metavar="X,Y,Z",
            parse=vector,
        ),
    ] = None,
    depth_m: Annotated[
        float | None,
        option("depth of the press; None: half the tip's radius, a sixth for mujoco", unit="m"),
    ] = None,
    unit: Annotated[str, option("unit of an STL's lengths", metavar="UNIT")] = "m",
    against: Annotated[
        ModelLike | None,
        option(
            "with a recording: the model whose depth, force and residual are written too",
            flag="--model",
            metavar="MODEL",
            reads=True,
        ),
    ] = None,
    call: Call,
) -> tuple[str, ...]:
    """Write a model for another program: a minimal scene that runs there, its mesh, or a page to be pressed.

    Of a recording: its samples, and with `against` what that model makes of them. Returns what the format
    cannot say, one line each. But for an STL's lengths all is in SI units, m, and the
    model's frame. Raises OptionError for an unknown format or a place that misses the object, FileError where
    the file cannot be written.
    """
    import numpy as np

    from palpate.exporting.registry import write
    from palpate.scenes.scene import Scene, load_scene

    if to in RECORDED:
        return _recorded(model, to, path, against, call)
    if against is not None:
        raise OptionError(
            f"--model goes with a recording, --to {' or '.join(RECORDED)}; for {to} name the MODEL itself"
        )
    plain = load(model, progress=call.wanted)
    scene = model if isinstance(model, Scene) else None
    if isinstance(model, str | Path) and names_scene(model):
        scene = load_scene(model)
    place = None if at is None else np.asarray(at)
    with call.progress("export") as show_progress:
        notes = write(
            plain, to, path, at=place, depth_m=depth_m, unit=unit, scene=scene, progress=show_progress
        )
    call.then(f"written for {to}: {path}", *(f"  {note}" for note in notes))
    call.following = [f"next: {FORMATS[to].opened_by.replace('`', '').format(path=path)}"]
    call.figures = {"to": to, "path": path, "notes": list(notes)}
    return notes


def _recorded(source: Any, to: str, path: str | Path, against: Any, call: Call) -> tuple[str, ...]:
    """Of a recording."""
    from palpate.exporting.recorded import Recorded
    from palpate.exporting.registry import check_recorded, write_recorded
    from palpate.operations.read_recording import read_recording

    check_recorded(to, Path(path))
    told = Recorded(read_recording(source))
    if against is not None:
        from palpate.operations.replay import replay

        made = replay(load(against, progress=call.wanted), told.recording, progress=call.wanted)
        told = Recorded(told.recording, made.model, made.force_n, made.contact)
    with call.progress("export") as show_progress:
        notes = write_recorded(told, to, path, show_progress)
    call.then(f"written for {to}: {path}", *(f"  {note}" for note in notes))
    call.following = [f"next: {RECORDED[to].opened_by.replace('`', '').format(path=path)}"]
    call.figures = {"to": to, "path": path, "notes": list(notes)}
    return notes
