"""Models touched: a renderer, a recording replayed, one press."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from mechanics.errors import OptionError
from mechanics.progress import Progress
from palpate.api.models import load
from palpate.api.reading import read_recording
from palpate.api.telling import told
from palpate.keywords import taken

if TYPE_CHECKING:
    import mechanics.model
    import mechanics.recording
    from mechanics.presses import Presses
    from palpate.api.telling import ModelLike, RecordingLike
    from render.base import Renderer
    from render.options import RenderOptions
    from render.press import Curve
    from render.replay import ReplayResult
    from render.scene import TouchScene


def renderer(
    model: ModelLike | Renderer, name: str = "fem", *, progress: bool | Progress = True, **options: Any
) -> Renderer:
    """The renderer of a model: `state = r.start()`, then `state, forces = r.step(state, tips)` at 1 kHz.

    tips (m, 3) m are the tips' centres, forces (m, 3) N act on the tool; device frame. name: "fem",
    "kelvin-voigt", "hunt-crossley", "hunt-crossley-undamped" or "hunt-crossley-kh". The model's compliance is
    computed, some seconds, or read from its folder. options: see `pp.options("renderer")`. Raises
    OptionError.
    """
    make = _renderer("renderer", model, name, options)
    with told("renderer", progress) as tell:
        return make(tell).renderer


def replay(
    model: ModelLike | Renderer,
    recording: RecordingLike,
    renderer: str = "fem",
    *,
    progress: bool | Progress = True,
    **options: Any,
) -> ReplayResult:
    """Feed a recorded tip path to a renderer and compare its force with the measured one.

    model: or a renderer that is there already. The result has t (n,) s, force_n (n, 3) N on the tool, the
    mask `contact`, and the error rmse_n, N, over it. The same input gives the same bits. options: see
    `pp.options("replay")`. Raises OptionError.
    """
    from reconstruct.steps.s3_contacts.quasi_static import is_points
    from render.replay import ReplayResult, replay_error, replay_recording

    make = _renderer("replay", model, renderer, options)
    measured = read_recording(recording)
    if is_points(measured):
        raise OptionError(
            f"'{measured.name}' holds points without a time, and a replay needs a path: reconstruct, compare "
            "and diagnose read points"
        )
    with told("replay", progress) as tell:
        scene = make(tell)
        forces = replay_recording(scene, measured, tell)
    error = replay_error(measured, _touched(measured, scene.model), forces)
    return ReplayResult(
        recording=measured,
        model=scene.model,
        renderer=scene.renderer.name,
        t=measured.t,
        force_n=forces,
        contact=error.contact,
        rmse_n=error.rmse_n,
        force_rms_n=error.force_rms_n,
        relative=error.relative,
    )


def press(
    model: ModelLike | Renderer,
    at: Sequence[float],
    direction: Sequence[float] | None = None,
    depth_m: float = 0.004,
    speed_m_per_s: float = 0.01,
    *,
    hold_s: float = 0.0,
    approach_m: float = 2e-3,
    rate_hz: float = 1000.0,
    tip_radius_m: float | None = None,
    renderer: str = "fem",
    progress: bool | Progress = True,
    **options: Any,
) -> Curve:
    """One scripted press: the force response of a model at one place.

    model: or a renderer that is there already, which saves seconds where many presses follow. at: (3,) m, the
    point that the tip's centre is aimed at; direction: (3,) of the motion, any length, None is straight onto
    the support; device frame. depth_m: along the surface's normal after first touch; speed_m_per_s, hold_s:
    of the motion and at depth; approach_m: of free air before; rate_hz: of the samples; tip_radius_m: None
    takes the model's. options: see `pp.options("press")`. Raises OptionError where the line misses object
    and support, or grazes them.
    """
    import numpy as np

    from render.press import press as pressed

    make = _renderer("press", model, renderer, options)
    with told("press", progress) as tell:
        scene = make(tell)
    along = -scene.model.support.normal if direction is None else np.asarray(direction, dtype=float)
    radius = scene.model.tool.tip_radius_m if tip_radius_m is None else float(tip_radius_m)
    return pressed(
        scene,
        np.asarray(at, dtype=float),
        along,
        depth_m,
        speed_m_per_s,
        hold_s=hold_s,
        approach_m=approach_m,
        rate_hz=rate_hz,
        tip_radius_m=radius,
    )


def _renderer(
    function: str, model: ModelLike | Renderer, name: str, options: Mapping[str, Any]
) -> Callable[[Progress], TouchScene]:
    """What will make the renderer, on its model's support; options are checked at once."""
    from render.base import Renderer
    from render.felt import with_own_stiffness
    from render.options import RenderOptions
    from render.registry import create, names
    from render.scene import scene_of
    from render.support import SupportOptions

    given = taken(function, options)
    support = SupportOptions(**given.get(SupportOptions, {}))
    if isinstance(model, Renderer):
        if given[RenderOptions]:
            words = "a renderer that is there keeps its options; give them to pp.renderer"
            raise OptionError(f"{', '.join(given[RenderOptions])}: {words}")
        return lambda tell: scene_of(model, support)
    if name not in names():
        raise OptionError(f"'{name}' is no renderer; allowed are {', '.join(names())}")
    chosen = _with_scene(model, RenderOptions(**given[RenderOptions]))

    def make(tell: Progress) -> TouchScene:
        made = create(name, load(model, progress=tell), chosen, tell)
        if made.model.path is not None:
            with_own_stiffness(made)
        return scene_of(made, support)

    return make


def _with_scene(model: ModelLike, options: RenderOptions) -> RenderOptions:
    """The options with what the scene's file says, where a scene was given."""
    from palpate.sources import with_friction
    from scenes.scene import Scene, load_scene

    scene = load_scene(model) if isinstance(model, str | Path) else model
    return with_friction(options, scene) if isinstance(scene, Scene) else options


def _touched(recording: mechanics.recording.Recording, model: mechanics.model.Model) -> Presses:
    """The recording's presses on the model; none where it holds none."""
    from mechanics.errors import ContactError
    from mechanics.press_making import no_presses
    from reconstruct.placing import presses_on

    try:
        return presses_on(recording, model)
    except ContactError:
        return no_presses(recording.tip_radius_m)
