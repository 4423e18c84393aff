"""A model: its size in lines, the object with the places touched."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from palpate.mechanics.model.files import write_model
from palpate.mechanics.model.model import Model
from palpate.show.model_view import thing_of, usual_colourings
from palpate.show.object3d import draw_touched
from palpate.show.page import Page, file_words, subplots
from palpate.show.quantities import KELVIN_VOIGT, MODULUS, softness, with_unit
from palpate.show.scenery import add_dots, add_object
from palpate.show.view3d import View

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from pyvista import Plotter


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
