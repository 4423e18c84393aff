"""Views of models: the object as a tip meets it, what it is coloured by, the curves of its presses."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from palpate.mechanics.model.model import Model
from palpate.mechanics.presses.table import Presses
from palpate.render.surface.felt_surface import felt_surface
from palpate.show.object3d import AZIMUTH_DEG, level_axes
from palpate.show.quantities import DEPTH, MODULUS, ORDER, STIFFNESS, UNCERTAINTY
from palpate.show.view3d import View
from palpate.show.view3d_parts import Colouring, Line, Thing, Traces


def view_of_presses(
    model: Model,
    presses: Presses,
    colourings: Sequence[Colouring],
    lines: Sequence[Line],
    selected: int,
    force: str = "into",
) -> View:
    """The object, seen from where the selected press is in front, with the curves of these presses."""
    azimuth = facing(model.support.normal, presses.normal[selected])
    traces = Traces(presses.starts, presses.depth, presses.t - presses.onset_s[presses.press], lines)
    return View(thing_of(model), presses.point, colourings, traces, selected, azimuth, force=force)


def rms_by_press(presses: Presses, off: np.ndarray) -> np.ndarray:
    """(p,) N, root mean square of force differences (n, 3) over each press."""
    return np.array([np.sqrt((off[part] ** 2).sum(axis=1).mean()) for part in presses.parts])


def usual_colourings(model: Model, presses: Presses | None = None) -> list[Colouring]:
    """What every model can tell: order and depth of its touches, the presses' own moduli, own stiffness,
    shape uncertainty. presses: those that are shown (None: the model's)."""
    surface, presses = felt_surface(model), model.presses if presses is None else presses
    order = np.arange(1.0, len(presses) + 1)
    stiffness = np.where(surface.touchable, surface.own_stiffness_n_per_m, np.nan)
    uncertainty = np.where(surface.touchable, surface.uncertainty_m, np.nan)
    modulus = presses.fits["e_pa"]
    of_press = "Of each press by itself; between presses what is near, paler where nobody touched."
    found = [
        Colouring(ORDER, None, order, "Each dot is where a press met the surface, in order of time."),
        Colouring(MODULUS, None, modulus, of_press, name="modulus of a press"),
        Colouring(STIFFNESS, stiffness, None, "Force over depth of a straight press of 1 mm there."),
        Colouring(UNCERTAINTY, uncertainty, None, "Standard deviation of the surface along its normal."),
        Colouring(DEPTH, None, presses.depth_m, "How deep each press went."),
    ]
    return found


def thing_of(model: Model) -> Thing:
    """What a tip meets of a model, on its support."""
    surface, support = felt_surface(model), model.support
    return Thing(surface.points, surface.triangles, surface.touchable, support.point, support.normal)


def local(presses: Presses, force_n: np.ndarray) -> np.ndarray:
    """(n, 3) N in the local frames of a table's rows, of forces in the device frame."""
    return np.einsum("nij,nj->ni", presses.frame[presses.press], force_n)


def facing(up: np.ndarray, out: np.ndarray) -> float:
    """Azimuth, degrees, from which a place with its outward normal (3,) is seen, slightly from aside; the
    usual one where it faces up."""
    across = level_axes(up) @ out
    if np.linalg.norm(across) < 0.3 * np.linalg.norm(out):
        return AZIMUTH_DEG
    return float(np.degrees(np.arctan2(across[1], across[0]))) - 20.0
