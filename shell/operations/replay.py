"""A recorded tip path through a renderer, headless: t,fx,fy,fz in s and N, the force on the tool.

The tip starts in the air; contact is found on the model's surface and its support alone, without looking at
the measured force. The same MODEL and REC give bit-identical output. What is printed compares with the
measured force over the contact samples: phase II, from first touch to its loss and 50 ms around.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated

from palpate.mechanics.errors import ContactError, OptionError
from palpate.mechanics.options import EXACT
from palpate.operations._call import Call
from palpate.operations._declare import Given, argument, operation, option
from palpate.operations._shared import RecordingArgument, Renders, output_option
from palpate.operations.read_recording import read_recording
from palpate.operations.renderer import touched_scene
from palpate.render.options import RenderOptions
from palpate.render.support import SupportOptions

if TYPE_CHECKING:
    import palpate.mechanics.model.model
    import palpate.mechanics.recording.recording
    from palpate.mechanics.presses.table import Presses
    from palpate.operations._shared import ModelLike
    from palpate.render.base import Renderer
    from palpate.render.replay import ReplayResult


@operation(common="friction dent_law effects")
def replay(
    model: Annotated[
        ModelLike | Renderer, argument("folder of a model, or a scene", metavar="MODEL", reads=True)
    ],
    recording: RecordingArgument,
    renderer: Renders = "fem",
    *,
    exact: Annotated[bool, option(EXACT)] = False,
    output: Annotated[
        str | None, output_option("write the forces", "FORCES.csv", "palpate.render.replay:FORCES")
    ] = None,
    render: Given[RenderOptions],
    support: SupportOptions,
    call: Call,
) -> ReplayResult:
    """Feed a recorded tip path to a renderer and compare its force with the measured one.

    model: or a renderer that is there already. The result has t (n,) s, force_n (n, 3) N on the tool, the
    mask `contact`, and the error rmse_n, N, over it. The same input gives the same bits. Raises OptionError,
    and ContactError for a recording that lies far from the model.
    """
    from palpate.mechanics.press_solver.solved_places import deepest_of_sites, said_beforehand
    from palpate.reconstruction.presses_on_model import check_near
    from palpate.reconstruction.steps.s3_contacts.quasi_static import is_points
    from palpate.render.exact import ExactPlaces, check_renderer, exact_replay
    from palpate.render.replay import ReplayResult, replay_error, replay_recording

    if exact:
        check_renderer(renderer)
    make = touched_scene(model, renderer, render, support)
    measured = read_recording(recording)
    if is_points(measured):
        raise OptionError(
            f"'{measured.name}' holds points without a time, and a replay needs a path: reconstruct, compare "
            "and diagnose read points"
        )
    with call.progress("replay") as show_progress:
        scene = make(show_progress)
        check_near(measured, scene.model)
        counted: list[int] = []
        forces = replay_recording(scene, measured, show_progress, counted.append)
    presses, solved = _touched(measured, scene.model), None
    if exact:
        places = ExactPlaces(scene.renderer, measured.tip_radius_m)
        sites = deepest_of_sites(presses.site, presses.deepest)
        call.out.say(f"--exact: {said_beforehand(len(sites))}")
        with call.progress("solving") as show_progress:
            solved = exact_replay(
                places, presses, sites, measured.t, measured.position, forces, show_progress
            )
        forces = solved.force_n
    error = replay_error(measured, presses, forces)
    result = ReplayResult(
        **vars(error),
        recording=measured,
        model=scene.model,
        renderer=scene.renderer.name,
        t=measured.t,
        force_n=forces,
        used=scene.renderer,
        exact=solved,
        unsettled=sum(counted),
    )
    call.then_save(result, output)
    return result


def _touched(
    recording: palpate.mechanics.recording.recording.Recording, model: palpate.mechanics.model.model.Model
) -> Presses:
    """The recording's presses on the model; none where it holds none."""
    from palpate.mechanics.presses.making import no_presses
    from palpate.reconstruction.presses_on_model import presses_on

    try:
        return presses_on(recording, model)
    except ContactError:
        return no_presses(recording.tip_radius_m)
