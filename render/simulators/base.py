"""What an adapter of another simulator is, and the renderer that drives one.

Its scene (mesh, contact, solver, step) is built in one place, for the renderer and for `palpate export`: by
`render/simulators/NAME.py`, or where the export is a script by `NAME_scene.py`, which that script holds.

An adapter makes a `World` whenever the tip comes near to the object: the body at rest, the tip in the air.
The world is stepped along the path until the tip is away again. So what a press leaves behind (creep, drift)
does not reach the next, and free air costs nothing.
"""

from __future__ import annotations

import dataclasses
import importlib
import importlib.metadata
import time
from abc import ABC, abstractmethod
from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple, Protocol, Self

import numpy as np
from scipy.spatial import cKDTree

from palpate.mechanics.effects.friction_slip import EFFECT as SLIP
from palpate.mechanics.errors import OptionError, PalpateError
from palpate.mechanics.extras import install_words
from palpate.mechanics.model.model import Model
from palpate.mechanics.names import number, pairs, words_of
from palpate.mechanics.shape.refine import refined_around
from palpate.mechanics.shape.tetmesh import TetMesh
from palpate.render.base import Renderer, check_radii, new_state
from palpate.render.options import RenderOptions
from palpate.render.simulators.tunable import Tunable
from palpate.render.surface.snapping import touched_surface

NEAR_M, AWAY_M = 0.5e-3, 1e-3
"""Of the tip's surface from the object: where a world begins, and where it ends."""
MOST_FRICTION = 10.0
"""Instead of a tip that sticks for ever, where friction is a number."""


class World(Protocol):
    """One touch in a simulator."""

    def step(self, dt_s: float, tip: np.ndarray) -> np.ndarray:
        """(3,) N on the tool once the tip's centre, (3,) m, is there, dt_s after the last step."""


class Touch(Protocol):
    """A touch in a simulator that has a time step of its own."""

    timestep_s: float

    def advance(self, tip: np.ndarray, velocity: np.ndarray) -> None:
        """One step of the simulator's own, at whose end the tip's centre is there; (3,) m, (3,) m/s."""

    def force(self) -> np.ndarray:
        """(3,) N on the tool after the last step."""


class SteppedWorld:
    """Such a touch, whose tip is led along straight lines from sample to sample, in whole steps; what is left
    of a sample goes to the next."""

    def __init__(self, touch: Touch, tip: np.ndarray) -> None:
        self._touch = touch
        self._tip, self._left, self._force = np.array(tip, dtype=float), 0.0, np.zeros(3)

    def step(self, dt_s: float, tip: np.ndarray) -> np.ndarray:
        """As `World.step`."""
        self._left += dt_s
        count = int(self._left / self._touch.timestep_s + 1e-9)
        self._left -= count * self._touch.timestep_s
        way = (np.asarray(tip, dtype=float) - self._tip) / max(count, 1)
        for _ in range(count):
            self._tip = self._tip + way
            self._touch.advance(self._tip, way / self._touch.timestep_s)
        if count:
            self._force = self._touch.force()
        return self._force


class Adapter(ABC):
    """One simulator. units: what it computes in. cannot: what it cannot say, a line each. advice: by
    numerical effect, in its own words. extra: the package's extra that installs it; needs: the modules that
    it imports."""

    name: str
    units: str
    cannot: tuple[str, ...]
    advice: dict[str, str]
    extra: str
    needs: tuple[str, ...] = ()

    poisson_limit = np.inf
    """The greatest Poisson's ratio that it is given."""

    presses: int | None = None
    """Of a recording, over how many it is run where nothing else is asked; None: all."""

    settings: dict[str, Any]
    """Of each of its two settings the frozen dataclass of numbers that `--simulator-set` changes."""

    tunables: tuple[Tunable, ...] = ()
    """Those that `palpate tune` may move, what costs least first."""

    def __init__(self, model: Model, options: RenderOptions, friction: float) -> None:
        self.model, self.friction = model, friction
        self.own = changed(self.settings[options.simulator_settings], options.simulator_set)
        self.mesh = model.mesh.linear()

    @property
    def version(self) -> str:
        """Of the simulator that is installed."""
        return importlib.metadata.version(self.name)

    @property
    def stated(self) -> dict[str, float]:
        """What it is given: young_modulus_pa, poisson_ratio, friction, tip_radius_m."""
        material = self.model.material
        return {
            "young_modulus_pa": material.young_modulus_pa,
            "poisson_ratio": min(material.poisson_ratio, self.poisson_limit),
            "friction": self.friction,
            "tip_radius_m": self.model.tool.tip_radius_m,
        }

    @abstractmethod
    def begin(self, tip: np.ndarray, radius_m: float) -> World:
        """A body at rest, and a tip of that radius with its centre at `tip` (3,) m, near the surface."""

    def mesh_around(self, tip: np.ndarray, radius_m: float, edge_m: float, reach_m: float) -> TetMesh:
        """The model's linear mesh with edges of at most about `edge_m` within `reach_m` of the place that is
        nearest to the tip."""
        touchable = self.mesh.points[np.unique(self.mesh.touchable_surface)]
        centre = touchable[np.argmin(np.linalg.norm(touchable - tip, axis=1))]
        away = max(float(np.linalg.norm(centre - tip)), 1e-9)
        foot = tip + (centre - tip) * min(1.0, radius_m / away)
        return graded(self.mesh, foot, edge_m, reach_m)


class SteppedAdapter(Adapter):
    """One that is stepped (`SteppedWorld`), whose friction is a number, and whose settings have
    edge_radii: a scene of the body and a tip serves all touches, but where its mesh is finer under
    each."""

    def __init__(self, model: Model, options: RenderOptions, friction: float) -> None:
        super().__init__(model, options, friction if np.isfinite(friction) else MOST_FRICTION)
        self._whole: tuple[float, Any] | None = None

    @abstractmethod
    def scene(self, mesh: TetMesh, radius_m: float) -> Any:
        """What is made of a mesh and a tip of that radius."""

    @abstractmethod
    def touch(self, scene: Any, tip: np.ndarray) -> Touch:
        """A touch of its own in such a scene, whose tip is there."""

    def mesh_under(self, tip: np.ndarray, radius_m: float) -> TetMesh:
        """The mesh of a scene that begins with the tip there: the model's, finer under it where the settings
        say so."""
        edge = self.own.edge_radii
        if not np.isfinite(edge):
            return self.mesh
        return self.mesh_around(tip, radius_m, edge * radius_m, 1.2 * radius_m)

    def begin(self, tip: np.ndarray, radius_m: float) -> World:
        if np.isfinite(self.own.edge_radii):
            scene = self.scene(self.mesh_under(tip, radius_m), radius_m)
        else:
            if self._whole is None or self._whole[0] != radius_m:
                self._whole = radius_m, self.scene(self.mesh, radius_m)
            scene = self._whole[1]
        return SteppedWorld(self.touch(scene, tip), tip)


class ScriptedAdapter(SteppedAdapter):
    """One whose scene is built by a module that imports nothing of ours: `palpate export` writes a script
    that holds it. The module has Scene(**given) with `given` as below, and Touch(scene, tip)."""

    scene_module: str

    def given(self, mesh: TetMesh, radius_m: float) -> dict[str, Any]:
        """What a scene is made of: points (n, 3) m, tetrahedra (m, 4), fixed nodes (f,), up (3,); numbers by
        name: of the tip, the material and the settings, but for the mesh's."""
        numbers = {"radius_m": radius_m, **self.stated, **dataclasses.asdict(self.own)}
        return {
            "points": mesh.points,
            "tetrahedra": mesh.tetrahedra,
            "fixed": np.flatnonzero(mesh.fixed),
            "up": self.model.support.normal,
            **{key: value for key, value in numbers.items() if key not in ("tip_radius_m", "edge_radii")},
        }

    def scene(self, mesh: TetMesh, radius_m: float) -> Any:
        return importlib.import_module(self.scene_module).Scene(**self.given(mesh, radius_m))

    def touch(self, scene: Any, tip: np.ndarray) -> Touch:
        made: Touch = importlib.import_module(self.scene_module).Touch(scene, tip)
        return made


def friction_of(model: Model, options: RenderOptions) -> float:
    """Coulomb's coefficient that a simulator is given: what the options say, else the model, else 1."""
    usual = float(model.effects.get(SLIP.name, {}).get("mu", 1.0))
    return usual if options.friction is None else options.friction


def graded(mesh: TetMesh, place: np.ndarray, edge_m: float, reach_m: float) -> TetMesh:
    """A linear mesh with edges of at most about `edge_m` within `reach_m` of a place (3,) m."""
    for share in (2.0, 1.5, 1.0, 1.0):
        mesh, _ = refined_around(mesh, place, share * reach_m, edge_m)
    return mesh


def changed(settings: Any, text: str) -> Any:
    """The settings with KEY=VALUE words over them; raises OptionError for what is not there or no number."""
    known = {f.name for f in dataclasses.fields(settings)}
    flag, values = "--simulator-set", {}
    for key, value in pairs(words_of(text), flag, "edge_radii=0.5"):
        if key not in known:
            raise OptionError(f"{flag} {key}={value}: allowed are {', '.join(sorted(known))}")
        values[key] = number(flag, key, value)
        if not values[key] > 0:
            raise OptionError(f"{flag} {key}={value}: it must be greater than 0")
    return dataclasses.replace(settings, **values)


def over(text: str, values: Mapping[str, Any]) -> str:
    """KEY=VALUE words with these values over them."""
    said = dict(pairs(words_of(text), "--simulator-set", "edge_radii=0.5")) | dict(values)
    return ",".join(f"{key}={value}" for key, value in said.items())


class SimulatedState(NamedTuple):
    """As render.base.State, and world: the World that is under way, in a list of one a tip."""

    forces: np.ndarray
    touching: np.ndarray
    points: np.ndarray
    normals: np.ndarray
    depths: np.ndarray
    stiffness: np.ndarray
    radii_m: np.ndarray
    dt_s: np.ndarray
    unsettled: np.ndarray
    world: list[World | None]


class SimulatorRenderer(Renderer):
    """Another simulator as a renderer: it takes its own time, and no servo should wait for it. Raises
    OptionError where it is not installed.

    spent_s: of the processor, for touches of simulated_s.
    """

    def __init__(self, name: str, model: Model, adapter: type[Adapter], options: RenderOptions) -> None:
        installed(adapter)
        self.name, self.model, self.options = name, model, options
        self.contact = touched_surface(model, options)
        self.adapter = adapter(model, options, friction_of(model, options))
        self._tree = cKDTree(self.contact.arrays.vertices)
        self.spent_s, self.simulated_s = 0.0, 0.0

    def start(self, radii_m: Sequence[float] | None = None, dt_s: float = 1e-3) -> SimulatedState:
        radii = check_radii(radii_m, self.model)
        return SimulatedState(*new_state(radii, dt_s), world=[None] * len(radii))

    def step(self, state: SimulatedState, tips: np.ndarray) -> tuple[SimulatedState, np.ndarray]:
        near = self._tree.query(np.asarray(tips, dtype=float))[0] - state.radii_m
        for i, tip in enumerate(np.asarray(tips, dtype=float)):
            state.forces[i] = self._force(state, i, tip, near[i])
            state.touching[i] = int(state.forces[i].any())
        return state, state.forces

    def _force(self, state: SimulatedState, i: int, tip: np.ndarray, near_m: float) -> np.ndarray | float:
        """(3,) N on tip i at (3,) m, near_m off the object. Raises OptionError where the simulator ends in an
        error of its own, or its force is no number; the touch is over then."""
        world, state.world[i] = state.world[i], None
        if (world is None and near_m >= NEAR_M) or near_m > AWAY_M:
            return 0.0
        try:
            if world is None:
                world = self.adapter.begin(tip, float(state.radii_m[i]))
            begun = time.process_time()
            force = world.step(float(state.dt_s[0]), tip)
            self.spent_s += time.process_time() - begun
            self.simulated_s += float(state.dt_s[0])
        except PalpateError:
            raise
        except Exception as error:  # another's code may raise anything
            raise self._ended(tip, str(error).strip().split("\n")[0] or type(error).__name__) from error
        if not np.isfinite(force).all():
            raise self._ended(tip, "its force is no number")
        state.world[i] = world
        return force

    def _ended(self, tip: np.ndarray, why: str) -> OptionError:
        numbers = ", ".join(sorted(f.name for f in dataclasses.fields(self.adapter.own)))
        return OptionError(
            f"{self.name} ended with the tip at {np.round(tip, 4).tolist()} m: {why}: try a coarser mesh or "
            f"a shorter step, --simulator-set KEY=VALUE of {numbers}"
        )

    def follow(self, state: SimulatedState, path: np.ndarray, steps_s: np.ndarray) -> np.ndarray:
        forces = np.zeros(np.shape(path))
        for k, (tips, step_s) in enumerate(zip(path, steps_s, strict=True)):
            state.dt_s[0] = step_s
            self.step(state, tips)
            forces[k] = state.forces
        return forces

    def with_modulus(self, young_modulus_pa: float) -> Renderer:
        return type(self)(
            self.name, self.model.with_modulus(young_modulus_pa), type(self.adapter), self.options
        )

    def with_friction(self, friction: float) -> Self:
        raise OptionError(f"{self.name} takes its friction when it is made: --friction {friction:g}")

    def with_series_compliance(self, compliance_m_per_n: float) -> Self:
        raise OptionError(f"{self.name} has no virtual coupling: it is no renderer for the 1 kHz loop")


def missing(adapter: type[Adapter], error: ImportError) -> OptionError:
    """What is said where a simulator is not installed."""
    return OptionError(
        f"'{adapter.name}' needs {error.name}, which is not installed: "
        + install_words(adapter.extra, error.name)
    )


def installed(adapter: type[Adapter]) -> None:
    """Raises OptionError where the simulator is not installed."""
    try:
        for name in adapter.needs:
            importlib.import_module(name)
    except ImportError as error:
        raise missing(adapter, error) from error
