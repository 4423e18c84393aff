"""Views of models: the object as a tip meets it, what it is coloured by, the curves of its presses.

A model: its size in lines, the object with the places touched.
"""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from palpate.mechanics.model.files import write_model
from palpate.mechanics.model.model import Model
from palpate.mechanics.presses.table import Presses
from palpate.render.surface.felt_surface import felt_surface
from palpate.show import story as say
from palpate.show.page import drawn, feel_step, file_words
from palpate.show.quantities import (
    DEPTH,
    KELVIN_VOIGT,
    MODULUS,
    ORDER,
    STIFFNESS,
    UNCERTAINTY,
    softness,
)
from palpate.show.scenery import AZIMUTH_DEG, add_dots, add_object, draw_touched, level_axes
from palpate.show.view3d import Colouring, Line, Thing, Traces, View
from palpate.words import kpa, mm, part_words, sure_kpa

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
    of_press = "Of each press by itself; between presses what is near, paler where it was not touched."
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


def story(result: Model) -> say.Story:
    """The model's size, and the object to be turned."""
    mesh, nu = result.mesh, result.material.poisson_ratio
    height = float(result.support.height(mesh.points).max())
    what = "Model" if result.name == "model" else f"Model of {result.name}"
    yield say.Headline(f"{what}: {modulus_words(result)}, Poisson's ratio {nu:g}")
    if parts := parts_words(result):
        yield say.Note(parts)
    if mended := mended_words(result):
        yield say.Note(mended)
    yield say.Sentence(f"About as soft as {softness(result.material.young_modulus_pa)}", on=say.PAGE)
    where = file_words(result.path, "MODEL")
    yield say.Next([
        feel_step(result.path, "palpate model FILE -o MODEL"),
        f"let others press it: `palpate export {where} --to page -o touch.html`",
    ])  # fmt: skip
    yield say.Turned(
        lambda: view(result),
        say.Picture(lambda: drawn(draw, result, 8, 4), "The object, and the places touched."),
        result,
    )
    yield say.Detail(
        f"{mm(height)} high; tip radius {mm(result.tool.tip_radius_m, '.4g')}; {presses_words(result)}; "
        f"effects: {', '.join(result.effects) or 'none'}"
    )
    low, high = (", ".join(f"{v:.3g}" for v in f(mesh.points, axis=0)) for f in (np.min, np.max))
    yield say.Detail(f"it lies within ({low}) to ({high}) m: `palpate press --at X,Y,Z` there")
    yield say.Detail(
        f"mesh: {len(mesh.points)} nodes, {len(mesh.tetrahedra)} tetrahedra of order {mesh.order}, "
        f"edges of {mm(result.mesh_size_m, '.4g')}"
    )
    yield say.Detail(f"folder: {result.path or 'not written; -o MODEL, in Python .save(MODEL), writes it'}")


KEYS: tuple[say.Key, ...] = (
    "model=path",
    "young_modulus_pa=material.young_modulus_pa",
    ("volume_m3", lambda result: result.mesh.volumes.sum()),
    ("nodes", lambda result: len(result.mesh.points)),
    ("tetrahedra", lambda result: len(result.mesh.tetrahedra)),
    "support_point_m=support.point",
    "support_normal=support.normal",
    ("parts", lambda result: result.provenance.get("parts", "")),
    ("mended", lambda result: result.provenance.get("mended", "")),
)


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


def presses_words(model: Model) -> str:
    """How many presses it holds, and whether anybody made them: '32 virtual presses'."""
    return f"{len(model.presses)} {'virtual ' if model.untouched else ''}presses"


def parts_words(model: Model) -> str:
    """What a mesh holds of several bodies or labels, and what was made of them; '' where it is one."""
    parts = model.provenance.get("parts", "")
    one = "" if part_words(model) else ": all of it is taken for one solid of one modulus, as was said"
    return f"the file holds {parts}{one}" if parts else ""


def mended_words(model: Model) -> str:
    """What was done to a mesh that was not closed; '' where it was."""
    mended = model.provenance.get("mended", "")
    volume = f"{1e6 * model.mesh.volumes.sum():.4g} cm³"
    return f"the file's surface was mended: {mended}; the model encloses {volume}" if mended else ""


def modulus_words(model: Model) -> str:
    """The Young's modulus with its 95 % interval, kPa."""
    ends = model.material.young_modulus_ci95_pa
    interval = f" ({sure_kpa(ends, '.1f').removesuffix(' kPa')})" if np.isfinite(ends).all() else ""
    return f"Young's modulus{part_words(model)} {kpa(model.material.young_modulus_pa)}{interval}"


def save(model: Model, path: Path | str) -> Model:
    """Write a MODEL folder that ParaView opens, and return the model that knows it.

    What is computed for the model later, its compliance, is kept there. Raises ModelError where the folder
    exists and holds something else.
    """
    return model.replaced(path=write_model(path, model))
