"""What every effect does to a press, drawn by the law that diagnosis fits and rendering steps.

`python docs/_effects.py` writes docs/images/effects/NAME.png: grey the ideal model, orange the same touch
with the effect. A block of 20 kPa, 100 x 100 x 50 mm, and a tip of 5 mm.
"""

from __future__ import annotations

import sys
from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path

import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt
import numpy as np
from scipy.ndimage import gaussian_filter1d
from scipy.spatial.transform import Rotation

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))
from palpate.diagnosis.forward.prediction import Forward
from palpate.mechanics.compliance.pressed_places import Places, solve_places
from palpate.mechanics.effects.registry import NAMES, effect
from palpate.mechanics.frames import tangents
from palpate.mechanics.model.material import ObjectMaterial
from palpate.mechanics.model.model import Model, Support, Tool
from palpate.mechanics.presses.making import of_paths
from palpate.mechanics.shape.tetmesh import box_mesh

FOLDER = Path(__file__).resolve().parent / "images" / "effects"
MODULUS_PA, NU, TIP_M, RATE_HZ = 20e3, 0.49, 0.005, 500.0
MIDDLE, ASIDE, RIM, FLANK = 0, 1, 2, 3
"""Places: top middle, 25 mm beside it, 8 mm from the rim, 12 mm above the foot."""
POINTS_M = np.array([[0.0, 0.0, 0.05], [0.025, 0.0, 0.05], [0.042, 0.0, 0.05], [0.05, 0.0, 0.012]])
NORMALS = np.array([[0, 0, 1.0], [0, 0, 1.0], [0, 0, 1.0], [1.0, 0, 0]])
IDEAL, WITH = "0.55", "#d95f02"


def path(*knots: tuple[float, float, float]) -> np.ndarray:
    """(n, 3) m into the object and sideways, from knots (s, mm in, mm sideways)."""
    at, deep, side = np.transpose(knots)
    t = np.arange(0, at[-1], 1 / RATE_HZ)
    ways = [gaussian_filter1d(np.interp(t, at, way), 0.012 * RATE_HZ, mode="nearest") for way in (deep, side)]
    return 1e-3 * np.stack([*ways, np.zeros_like(t)], axis=1)


PRESS = path((0, -3, 0), (0.35, 4, 0), (0.95, 4, 0), (1.3, -3, 0))
SHALLOW = path((0, -3, 0), (0.35, 1.5, 0), (0.95, 1.5, 0), (1.3, -3, 0))
DEEP = path((0, -2, 0), (0.5, 9, 0), (1.0, -2, 0))
QUICK = path((0, -3, 0), (0.12, 4, 0), (0.72, 4, 0), (0.84, -3, 0))
SLOW = path((0, -3, 0), (1.4, 4, 0), (2.0, 4, 0), (3.4, -3, 0))
TWICE = path((0, -3, 0), (0.35, 4, 0), (0.7, -3, 0), (0.9, -3, 0), (1.25, 4, 0), (1.6, -3, 0))
DRAG = path((0, -3, 0), (0.35, 3, 0), (1.1, 3, 4), (1.85, 3, -4), (2.2, -3, -4))
WAVE = path(
    (0, -3, 0), (1, -3, 0), (1.35, 4, 0), (1.7, -3, 0), (4, -3, 0), (4.35, 4, 0), (4.7, -3, 0), (6, -3, 0)
)


@dataclass(frozen=True)
class Panel:
    """One picture: the touches (place, path) and what is drawn over what."""

    title: str
    touches: tuple[tuple[int, np.ndarray], ...]
    over: str = "depth"


def press(place: int = MIDDLE, way: np.ndarray = PRESS) -> Panel:
    """Force over depth."""
    return Panel("one press", ((place, way),))


def in_time(title: str, way: np.ndarray, place: int = MIDDLE) -> Panel:
    """Force over time."""
    return Panel(title, ((place, way),), "time")


def places(title: str, *at: int) -> Panel:
    """Force over depth at several places."""
    return Panel(title, tuple((place, PRESS) for place in at))


DEEP_PRESS = Panel("a deep press", ((MIDDLE, DEEP),))
PACES = Panel("quick and slow", ((MIDDLE, QUICK), (MIDDLE, SLOW)))
DRAGGED = Panel("dragged to and fro", ((MIDDLE, DRAG),), "drag")
ON_HOLD = in_time("a hold", PRESS)
DEPTHS = Panel("holds, deep and shallow", ((MIDDLE, PRESS), (MIDDLE, SHALLOW)), "time")
PANELS: dict[str, tuple[tuple[float, ...], Panel, Panel]] = {
    "finite_strain": ((), DEEP_PRESS, ON_HOLD),
    "strain_stiffening": ((0.8,), DEEP_PRESS, ON_HOLD),
    "viscoelasticity": ((0.35, np.log(0.08), 0.25, np.log(0.9)), ON_HOLD, PACES),
    "power_law_relaxation": ((0.25, 0.3), ON_HOLD, PACES),
    "poroelasticity": ((0.5, np.log(2.0)), DEPTHS, PACES),
    "mullins_softening": (
        (0.25, 0.4),
        in_time("pressed twice", TWICE),
        Panel("pressed twice", ((MIDDLE, TWICE),)),
    ),
    "poisson_ratio": ((0.36,), press(), DEEP_PRESS),
    "inclusion": (
        (0.0, 0.0, 0.034, 0.011, np.log(8.0)),
        places("above it", MIDDLE),
        places("25 mm beside it", ASIDE),
    ),
    "modulus_gradient": ((1.2,), press(), places("near the foot", FLANK)),
    "skin_layer": ((0.003, np.log(3.0)), press(), places("near the foot", FLANK)),
    "stiffness_field": ((1.2, -1.0, *[0.0] * 8), press(), places("25 mm beside", ASIDE)),
    "surface_shape": ((), press(), places("25 mm beside", ASIDE)),
    "unbonded_base": ((0.6, np.pi, 0.95), press(), places("near the loose foot", FLANK)),
    "compliant_base": ((np.log(2.5), np.log(0.6)), press(), places("near the foot", FLANK)),
    "surface_offset": ((0.001, 0, 0.0006, 0, 0, 0), press(), places("from the side", FLANK)),
    "tip_radius": ((1.4,), press(), ON_HOLD),
    "friction_slip": ((0.15,), DRAGGED, press()),
    "adhesion": ((0.1, 1.5e-3, 0.3), press(), ON_HOLD),
    "jkr_adhesion": ((0.06, 0.2, 5e-4), press(), ON_HOLD),
    "tool_compliance": ((1 / 600,), press(), DEEP_PRESS),
    "force_bias": ((0.0, 0.0, 0.12), in_time("air, press, air", PRESS), press()),
    "force_drift": ((0.0, 0.0, 0.05), in_time("two presses", WAVE), press()),
    "force_gain": (
        (1.0, 0, 0.15, 0, 1.0, 0.15, 0, 0, 1.12),
        press(),
        Panel("sideways", ((MIDDLE, PRESS),), "sideways"),
    ),
    "tool_gravity_inertia": ((0.06, 0.0), in_time("a tool that turns", WAVE), press()),
    "time_delay": ((0.03,), PACES, ON_HOLD),
    "backlash": ((6e-4,), press(), in_time("pressed twice", TWICE)),
}
"""Of each effect: its values as a fit moves them, and its two panels."""


class Block:
    """The object, its solved places and the touches that are laid over them."""

    @cached_property
    def places(self) -> Places:
        """All four places."""
        mesh = box_mesh((10, 10, 5), (0.1, 0.1, 0.05))
        support = Support(np.zeros(3), np.array([0, 0, 1.0]))
        model = Model(
            mesh, ObjectMaterial(MODULUS_PA, NU), tool=Tool(TIP_M), support=support, mesh_size_m=0.01
        )
        frames = np.stack([np.stack([n, *tangents(n)]) for n in NORMALS])
        return solve_places(model, POINTS_M, NORMALS, frames)

    def forward(self, way: np.ndarray) -> Forward:
        """The same way at every place."""
        p = len(POINTS_M)
        centre = POINTS_M + TIP_M * NORMALS
        position = np.concatenate([c - way @ f for c, f in zip(centre, self.places.frame, strict=True)])
        presses = of_paths(
            len(way) * np.arange(p + 1), position, np.zeros_like(position), centre, NORMALS,
            tip_radius_m=TIP_M, sample_rate_hz=RATE_HZ,
        )  # fmt: skip
        # the handle turns by 50 degrees and back while the hand moves on
        angle = np.tile(np.radians(50) * np.sin(np.linspace(0, np.pi, len(way))), p)
        turned = Rotation.from_rotvec(angle[:, None] * np.array([1.0, 0, 0]))
        presses = replace(
            presses, columns={"lead": np.zeros_like(position)}, quaternion=turned.as_quat(scalar_first=True)
        )
        return Forward(presses, self.places)

    def forces(
        self, place: int, way: np.ndarray, name: str = "", values: tuple[float, ...] = ()
    ) -> np.ndarray:
        """(n, 3) N on the tool, the place's frame; of the ideal model where no effect is named."""
        forward = self.forward(way)
        settings = forward.ideal(MODULUS_PA)
        if name == "surface_shape":  # it has no law: places come out too stiff or too soft
            settings.stiffness = np.array([1.15, 0.86, 0.8, 1.2])
        elif name:
            effect(name).act(settings, np.array(values, dtype=float), forward)
        return forward.predict(settings)[place * len(way) : (place + 1) * len(way)]


AXES: dict[str, tuple[str, Callable[[np.ndarray, np.ndarray], tuple[np.ndarray, np.ndarray]], str]] = {
    "depth": ("depth [mm]", lambda way, force: (1e3 * way[:, 0], force[:, 0]), "force [N]"),
    "time": ("time [s]", lambda way, force: (np.arange(len(way)) / RATE_HZ, force[:, 0]), "force [N]"),
    "drag": ("moved sideways [mm]", lambda way, force: (1e3 * way[:, 1], force[:, 1]), "sideways force [N]"),
    "sideways": ("depth [mm]", lambda way, force: (1e3 * way[:, 0], force[:, 1]), "sideways force [N]"),
}


def draw(block: Block, name: str) -> plt.Figure:
    """The two panels of an effect."""
    values, *panels = PANELS[name]
    figure, axes = plt.subplots(1, 2, figsize=(6.4, 2.5), layout="constrained")
    for ax, panel in zip(axes, panels, strict=True):
        label, coordinates, force_label = AXES[panel.over]
        for k, (place, way) in enumerate(panel.touches):
            style = ("-", "--")[k]
            ideal = block.forces(place, way)
            with_it = block.forces(place, way, name, values)
            ax.plot(*coordinates(way, ideal), color=IDEAL, linestyle=style, linewidth=2.2, label="ideal")
            ax.plot(*coordinates(way, with_it), color=WITH, linestyle=style, linewidth=1.3, label="with it")
        ax.set_title(panel.title, fontsize=9)
        ax.set(xlabel=label, ylabel=force_label)
        ax.spines[["top", "right"]].set_visible(False)
    handles, labels = axes[0].get_legend_handles_labels()
    axes[0].legend(handles[:2], labels[:2], frameon=False, fontsize=8)
    return figure


def main(names: tuple[str, ...] = NAMES) -> None:
    """Write every picture."""
    block = Block()
    FOLDER.mkdir(parents=True, exist_ok=True)
    for name in names:
        figure = draw(block, name)
        figure.savefig(FOLDER / f"{name}.png", dpi=110)
        plt.close(figure)


if __name__ == "__main__":
    main(tuple(sys.argv[1:]) or NAMES)
