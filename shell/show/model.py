"""Views of models: the object as a tip meets it, what it is coloured by, the curves of its presses.

A model: its size in lines, the object with the places touched.
"""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from palpate.mechanics.model.files import write_model
from palpate.mechanics.model.model import Model
from palpate.mechanics.presses.table import Presses
from palpate.render.surface.felt_surface import felt_surface
from palpate.show.page import Page, file_words, subplots
from palpate.show.quantities import (
    DEPTH,
    KELVIN_VOIGT,
    MODULUS,
    ORDER,
    STIFFNESS,
    UNCERTAINTY,
    softness,
    with_unit,
)
from palpate.show.scenery import AZIMUTH_DEG, add_dots, add_object, draw_touched, level_axes
from palpate.show.view3d import Colouring, Line, Thing, Traces, View

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from pyvista import Plotter


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


def lines(result: Model) -> list[str]:
    """What `print` says, with units."""
    mesh, nu = result.mesh, result.material.poisson_ratio
    height = float(result.support.height(mesh.points).max())
    return [
        f"Model of {result.name}: {modulus_words(result)}, Poisson's ratio {nu:g}",
        f"  {with_unit(height, 'mm', 1e3, 3)} high; "
        f"tip radius {with_unit(result.tool.tip_radius_m, 'mm', 1e3)}; {presses_words(result)}; "
        f"effects: {', '.join(result.effects) or 'none'}",
        f"  mesh: {len(mesh.points)} nodes, {len(mesh.tetrahedra)} tetrahedra of order {mesh.order}, "
        f"edges of {with_unit(result.mesh_size_m, 'mm', 1e3)}",
        f"  folder: {result.path or 'not written; .save(MODEL) writes it'}",
    ]


def as_json(result: Model) -> dict[str, Any]:
    """The figures of `palpate model --json`, keys with units."""
    return {
        "model": None if result.path is None else str(result.path),
        "young_modulus_pa": result.material.young_modulus_pa,
        "volume_m3": float(result.mesh.volumes.sum()),
        "nodes": len(result.mesh.points),
        "tetrahedra": len(result.mesh.tetrahedra),
        "support_point_m": result.support.point,
        "support_normal": result.support.normal,
    }


def draw(result: Model, ax: Axes) -> None:
    """The object with the places touched."""
    draw_touched(ax, result)
    ax.set_title(f"{result.name}: {modulus_words(result)}", fontsize=10)


def view(result: Model) -> View:
    """The object to be turned, coloured by what is known of it."""
    return View(thing_of(result), result.presses.point, usual_colourings(result))


def place(result: Model, plotter: Plotter) -> None:
    """The object on its support, the touches coloured by their own modulus."""
    add_object(plotter, result)
    for name, quantity in (("e_pa", MODULUS), ("k_v", KELVIN_VOIGT)):
        values = quantity.scale * result.presses.fits[name]
        known = np.isfinite(values)
        if known.any():
            add_dots(
                plotter,
                result.presses.point[known],
                values[known],
                label=quantity.label,
                limits=quantity.limits(float(values[known].min()), float(values[known].max())),
                colour_map=quantity.colour_map,
            )
            break


def next_steps(result: Model) -> list[str]:
    """What to do with a model."""
    where = file_words(result.path, "MODEL")
    return [
        f"feel it: `palpate touch {where}`",
        f"let others press it: `palpate export {where} --to page -o touch.html`",
    ]


def tell(result: Model, page: Page) -> None:
    """The model's size, and the object to be turned, into a page."""
    first, *rest = lines(result)
    page.lead(f"{first}.")
    page.paragraph(f"About as soft as {softness(result.material.young_modulus_pa)}.")
    page.next_steps(next_steps(result))
    figure, ax = subplots(1, 1, figsize=(8, 4))
    draw(result, ax)
    page.view(view(result), figure, "The object, and the places touched.", result)
    for line in rest:
        page.paragraph(line.strip())


def presses_words(model: Model) -> str:
    """How many presses it holds, and whether anybody made them: '32 virtual presses'."""
    return f"{len(model.presses)} {'virtual ' if model.untouched else ''}presses"


def modulus_words(model: Model) -> str:
    """The Young's modulus with its 95 % interval, kPa."""
    low, high = np.array(model.material.young_modulus_ci95_pa) / 1e3
    interval = f" (95 % sure: {low:.1f} to {high:.1f})" if np.isfinite([low, high]).all() else ""
    return f"Young's modulus {model.material.young_modulus_pa / 1e3:.2f} kPa{interval}"


def save(model: Model, path: Path | str) -> Model:
    """Write a MODEL folder that ParaView opens, and return the model that knows it.

    What is computed for the model later, its compliance, is kept there. Raises ModelError where the folder
    exists and holds something else.
    """
    return model.replaced(path=write_model(path, model))
