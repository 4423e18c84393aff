"""Flaws planted in other simulators themselves: settings made worse, parameters given wrongly.

A small block is pressed by each simulator as resolved as it can be afforded here (its control), and with
one or two of its settings changed. What a change does is measured: the force with it less the force without.
Every run is kept by all that it depends on, so a benchmark can be resumed.

A parameter is given so wrongly that our law's force changes by a drawn multiple (TIMES) of what can be seen,
or as much as it can. What a setting does is known only once it was run: its strength is drawn from a range.
"""

from __future__ import annotations

import dataclasses
import math
import tempfile
from contextlib import chdir
from dataclasses import dataclass, field
from functools import cache
from importlib.metadata import version
from pathlib import Path
from typing import Any

import numpy as np

from benchmarks._simulated_flaws import MODULUS_PA, NOISE_N, RADIUS_M, Block, Given, Layout
from palpate.diagnosis.other_simulator.declared_parameters import Stated
from palpate.mechanics.disk.store import content_key
from palpate.mechanics.disk.writing import atomic_file
from palpate.mechanics.model.material import ObjectMaterial
from palpate.mechanics.model.model import Model, Tool
from palpate.mechanics.progress import silent
from palpate.mechanics.shape.tetmesh import TetMesh, box_mesh
from palpate.render.options import BEST, RenderOptions
from palpate.render.registry import create
from palpate.render.replay import replay, rms_n
from palpate.render.simulators import base

POISSON = 0.40
"""Of the object: what every one of them can be given."""
STICKS = 1.0
"""Friction of a control: nowhere in these presses is the sideways force so large a share of the push."""
LAYOUT = Layout(
    size_m=(0.04, 0.04, 0.02),
    top=((0.0, 0.0), (-0.008, -0.008), (-0.008, 0.008), (0.008, -0.008), (0.008, 0.008), (0.0, 0.012)),
    side=(),
    depths_m=(0.0012, 0.0018, 0.0024),
    speeds_m_per_s=(0.02, 0.04, 0.08),
    holds_s=(0.03, 0.08),
    across_m=0.0006,
    rest_s=(0.2, 0.15),
    poisson=POISSON,
)


@dataclass(frozen=True)
class Simulation:
    """What one simulator is run with: cells of the block's mesh along a side; settings over its best ones;
    and what it is given."""

    cells: int
    settings: dict[str, float] = field(default_factory=dict)
    modulus_pa: float = MODULUS_PA
    poisson: float = POISSON
    friction: float = STICKS
    radius_m: float = RADIUS_M

    def but(self, change: dict[str, float]) -> Simulation:
        """The same with settings or fields changed."""
        fields: dict[str, Any] = {k: v for k, v in change.items() if k in _FIELDS}
        others = {k: v for k, v in change.items() if k not in _FIELDS}
        return dataclasses.replace(self, settings=self.settings | others, **fields)

    @property
    def stated(self) -> Stated:
        """All that it was given, said."""
        given = frozenset(("young_modulus_pa", "poisson_ratio", "friction", "tip_radius_m"))
        friction = self.friction if self.friction < STICKS else np.inf
        return Stated(self.modulus_pa, self.poisson, friction, self.radius_m, given)


ALIKE = 0.05
"""Share of our law's force within which a control is taken to have no flaw of its own."""
_FIELDS = {"cells", "modulus_pa", "poisson", "friction", "radius_m"}
_WHOLE = {"edge_radii": math.inf}
CONTROLS = {
    "scikit-fem": Simulation(14, _WHOLE),
    "mujoco": Simulation(10, _WHOLE | {"timestep_s": 0.002}),
    "drake": Simulation(9, _WHOLE | {"timestep_s": 0.004, "sphere_radii": 0.4}),
    "newton": Simulation(9, _WHOLE | {"timestep_s": 0.002}),
}
"""One mesh serves all presses of a run: a finer one under each costs twenty times as much. So where elements
are linear a control is much too stiff, and is told so."""


TIMES = (2.0, 20.0)
"""Multiples of what can be seen of a parameter, least and greatest."""
FORCE_SHARE, NOISE_SHARE = 0.02, 0.5
"""Of the force, and of the noise: what of a change of force can be seen at least (`--smallest`)."""
WRONG: dict[str, tuple[tuple[float, ...], ...]] = {
    "poisson": ((POISSON, 0.35, 0.3, 0.2, 0.1),),
    "modulus_pa": (
        tuple(MODULUS_PA * x for x in (1.0, 1.1, 1.3, 1.6, 2.0, 3.0)),
        tuple(MODULUS_PA * x for x in (1.0, 0.9, 0.75, 0.6, 0.45, 0.3)),
    ),
    "friction": ((STICKS, 0.3, 0.2, 0.1, 0.05, 0.02),),
    "radius_m": (
        tuple(RADIUS_M * x for x in (1.0, 1.02, 1.05, 1.1, 1.2, 1.35)),
        tuple(RADIUS_M * x for x in (1.0, 0.98, 0.95, 0.9, 0.83, 0.75)),
    ),
}
"""What each parameter is given in place of what is right, the least wrong first; to one side or the other."""


class Parameters:
    """What our law's force changes by where a parameter is given wrongly."""

    def __init__(self, block: Block) -> None:
        self._block, self._law = block, block.force(Given(poisson=POISSON))
        self._pressed = self._law.any(axis=1)
        self.visible_n = max(FORCE_SHARE * self._rms(self._law), NOISE_SHARE * math.sqrt(3) * NOISE_N)
        self._sizes: dict[tuple[str, int], list[float]] = {}

    def _rms(self, force: np.ndarray) -> float:
        return rms_n(force[self._pressed])

    def sizes_n(self, field: str, side: int) -> list[float]:
        """N rms, of each of WRONG[field][side]."""
        if (field, side) not in self._sizes:
            given = [{"poisson": POISSON, field: value} for value in WRONG[field][side][1:]]
            off = [self._rms(self._block.force(Given(**each)) - self._law) for each in given]
            self._sizes[field, side] = [0.0, *off]
        return self._sizes[field, side]

    def wrong_by(self, field: str, side: int, times: float) -> float:
        """The value whose change is so many times what can be seen, or the wrongest of WRONG."""
        return float(np.interp(times * self.visible_n, self.sizes_n(field, side), WRONG[field][side]))


@dataclass(frozen=True)
class AdapterFlaw:
    """right: the names that say it. parameter: the field that is given wrongly. settings: by adapter the
    setting that is made worse, and from where to where; without both the mesh is made coarser."""

    name: str
    right: tuple[str, ...]
    parameter: str | None = None
    settings: dict[str, tuple[str, float, float]] | None = None

    def of(self, adapter: str) -> bool:
        """Whether that simulator can have it."""
        return self.settings is None or adapter in self.settings

    def draw(self, adapter: str, rng: np.random.Generator, parameters: Parameters) -> dict[str, float]:
        """What is changed."""
        if self.parameter is not None:
            side = int(rng.integers(len(WRONG[self.parameter])))
            return {self.parameter: parameters.wrong_by(self.parameter, side, _within(rng, *TIMES))}
        if self.settings is None:
            return {"cells": int(rng.integers(4, 9))}
        key, low, high = self.settings[adapter]
        return {key: _within(rng, low, high)}


def _within(rng: np.random.Generator, low: float, high: float) -> float:
    return float(np.exp(rng.uniform(math.log(low), math.log(high))))


FLAWS: tuple[AdapterFlaw, ...] = (
    AdapterFlaw("element size", ("mesh_stiffness", "contact_nodes")),
    AdapterFlaw(
        "contact stiffness",
        ("contact_stiffness", "tunnelling"),
        settings={
            "scikit-fem": ("penalty", 0.3, 4.0),
            "mujoco": ("solref_s", 0.008, 0.03),
            "newton": ("contact_n_per_m", 50.0, 600.0),
        },
    ),
    AdapterFlaw(
        "damping",
        ("numerical_damping",),
        settings={
            "mujoco": ("damping_s", 0.01, 0.06),
            "drake": ("damping_s", 0.01, 0.06),
            "newton": ("damping_s", 0.003, 0.03),
        },
    ),
    AdapterFlaw(
        "time step",
        ("time_step", "numerical_damping"),
        settings={
            "mujoco": ("timestep_s", 0.003, 0.008),
            "drake": ("timestep_s", 0.01, 0.03),
            "newton": ("timestep_s", 0.004, 0.016),
        },
    ),
    AdapterFlaw("poisson", ("stated_poisson_ratio",), "poisson"),
    AdapterFlaw("modulus", ("stated_modulus",), "modulus_pa"),
    AdapterFlaw("friction", ("stated_friction",), "friction"),
    AdapterFlaw("tip", ("stated_tip_radius",), "radius_m"),
)


def squeezed_mesh(cells: int) -> TetMesh:
    """The block of LAYOUT, finer in the middle of its top."""
    size = np.array(LAYOUT.size_m)
    mesh = box_mesh((cells, cells, max(2, round(0.4 * cells))), LAYOUT.size_m)
    side = mesh.points[:, :2] / (0.5 * size[:2])
    below = 1 - mesh.points[:, 2] / size[2]
    points = np.column_stack(
        [0.5 * size[:2] * (0.7 * side + 0.3 * side**3), size[2] * (1 - 0.5 * below - 0.5 * below**2)]
    )
    return dataclasses.replace(mesh, points=points)


@cache
def _code_of(adapter: str) -> tuple[str, ...]:
    """What its forces depend on beside what it is given: its version, and our files that ask it."""
    home = Path(base.__file__).parent
    files = *sorted(home.glob(f"{adapter.replace('-', '_')}*.py")), home / "base.py"
    return version(adapter), *(file.read_text() for file in files)


class Runs:
    """Runs of simulators over one block's presses, kept in a folder; None: only here."""

    def __init__(self, folder: Path | None) -> None:
        self.block, self.folder = Block(0, LAYOUT), folder
        self.law = self.block.force(Given(poisson=POISSON))
        _, self.model = self.block.measured(np.random.default_rng(0), self.law)
        self._here: dict[str, np.ndarray] = {}

    def force(self, adapter: str, simulation: Simulation) -> np.ndarray:
        """(n, 3) N on the tool."""
        settings = dict(sorted(simulation.settings.items()))
        content = dataclasses.replace(simulation, settings=settings), LAYOUT, _code_of(adapter)
        key = content_key(adapter, *content)
        path = None if self.folder is None else self.folder.resolve() / f"{key}.npy"
        if key not in self._here and path is not None and path.exists():
            self._here[key] = np.load(path)
        if key not in self._here:
            self._here[key] = self._run(adapter, simulation)
            if path is not None:
                path.parent.mkdir(parents=True, exist_ok=True)
                with atomic_file(path) as temporary, temporary.open("wb") as handle:
                    np.save(handle, self._here[key])
        return self._here[key]

    def _run(self, adapter: str, simulation: Simulation) -> np.ndarray:
        model: Model = dataclasses.replace(
            self.model,
            mesh=squeezed_mesh(simulation.cells),
            material=ObjectMaterial(simulation.modulus_pa, simulation.poisson),
            tool=Tool(simulation.radius_m),
        )
        said = ",".join(f"{key}={value!r}" for key, value in simulation.settings.items())
        options = RenderOptions(friction=simulation.friction, simulator_settings=BEST, simulator_set=said)
        # MuJoCo leaves its warnings in a file where it runs
        with tempfile.TemporaryDirectory() as folder, chdir(folder):
            touched = create(adapter, model, options)
            return replay(touched, self.block.t, self.block.centre, progress=silent)


def drawn_plan(
    adapter: str, rng: np.random.Generator, singles: int, pairs: int, parameters: Parameters
) -> list[tuple[tuple[AdapterFlaw, dict[str, float]], ...]]:
    """Cases of one flaw, of each kind in turn, and of two: two of the single ones at once, so that each alone
    is run already."""
    able = [flaw for flaw in FLAWS if flaw.of(adapter)]
    kinds = [able[k % len(able)] for k in range(singles)]
    alone = [(flaw, flaw.draw(adapter, rng, parameters)) for flaw in kinds]
    both: list[tuple[Any, ...]] = []
    while len(both) < pairs and len({flaw.name for flaw, _ in alone}) > 1:
        one, two = sorted(rng.choice(len(alone), 2, replace=False))
        if alone[one][0].name != alone[two][0].name:
            both.append((alone[one], alone[two]))
    return [*((each,) for each in alone), *both]
