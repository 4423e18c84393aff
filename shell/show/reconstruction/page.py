"""The report of a reconstruction: the paper's figures and table, remade from a recording, beside its
numbers."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from palpate.mechanics.contact.touch import forces_at
from palpate.mechanics.model.model import Model
from palpate.reconstruction.pipeline import Reconstruction
from palpate.reconstruction.steps.s4_surface import Surface
from palpate.reconstruction.steps.s6_one_d import low_passed
from palpate.show.model import local, rms_by_press, usual_colourings, view_of_presses
from palpate.show.page import Page, file_words, subplots
from palpate.show.quantities import ERROR, MODULUS, softness
from palpate.show.reconstruction.differences import differences, trend_words
from palpate.show.reconstruction.exploration import exploration_figures
from palpate.show.reconstruction.modulus import (
    depth_figure,
    height_trends,
    moduli_figure,
    over_surface,
    quality_histogram,
    spatial_figure,
    undamped_figure,
)
from palpate.show.reconstruction.tables import (
    one_d_table,
    paper_remade,
    point_load_table,
    speed_table,
    table_one,
    trends_table,
)
from palpate.show.scenery import Colours, draw_object, draw_touched
from palpate.show.view3d import Colouring, Line, View

if TYPE_CHECKING:
    from matplotlib.figure import Figure


def report(result: Reconstruction, path: Path | str, beside: dict[str, Model] | None = None) -> Path:
    """Write the page, and its figures as PNGs into the folder PATH without suffix; returns the page's path.

    A path without suffix gets '.html': its own name is the folder's.
    beside: other models by name, drawn beside in Figures 4 and 6 and in Table 1.
    """
    path = Path(path)
    path = path if path.suffix else path.with_suffix(".html")
    figures = _figures(result, beside or {})
    page = Page(f"Reconstruction of {result.exploration.recording.name}")
    page.save(path.with_suffix(""), figures)
    tell(result, page, figures["object"])
    page.heading("Exploration and geometry")
    page.paragraph(
        "From here on: the figures and tables of the paper whose method this is, remade from this recording "
        "(Goksel, Jeon, Harders and Székely, Deformable Haptic Model Generation Through Manual Exploration)."
    )
    page.figure(
        figures["figure-2"], "Force magnitude, first touches (o) and peaks (+) (the paper's Figure 2)."
    )
    page.figure(
        figures["figure-3abc"],
        "(a) First touches (+) and base outline with its farthest-point sample (o); (b) mesh, fixed base "
        "nodes and the nodes nearest to the contacts, in order; (c) force over depth of every palpation (the "
        "paper's Figure 3).",
    )
    _not_used(page, result)
    page.figure(figures["figure-mesh"], _mesh_words(result))
    page.heading("1D models")
    page.figure(
        figures["figure-3d"],
        "A spring k and a damper b for each press: proportional to depth (Kelvin–Voigt, KV), or to a power r "
        "of it (Hunt–Crossley, HC); a dot is a press (the paper's Figure 3(d)).",
    )
    page.figure(
        figures["figure-4"],
        "The same without the damper: (a) k_V, a spring alone; (b, c) k_C, one of a power r of depth; (d) "
        "k_H, the same at the mean power of all presses (the paper's Figure 4).",
    )
    one_d_table(page, result)
    page.heading("Where the parameters hold")
    page.figure(
        figures["figure-5"],
        "Above, k_V over the surface (radial basis functions through the presses, dots); below, k_V, k_H and "
        "e over height on the side, relative to their means and on one scale (the paper's Figure 5).",
    )
    trends_table(page, height_trends(result.model))
    if words := trend_words(result):
        page.paragraph(words)
    page.heading("Modulus")
    page.figure(
        figures["figure-6"],
        "(a) Moduli of single palpations, * the global one with its 95 % interval; (b) where (the paper's "
        "Figure 6).",
    )
    page.table(*table_one(result, beside or {}))
    if "figure-depth" in figures:
        page.figure(figures["figure-depth"], "Global modulus from samples up to a greatest depth.")
    point_load_table(page, result)
    page.heading("Where this differs from the paper, and why")
    for words in differences(result):
        page.paragraph(words)
    speed_table(page, result)
    page.result(result.as_json())
    return page.write(path)


def view(result: Reconstruction) -> View:
    """The object; each press as measured and as the model with its one modulus answers the same path."""
    model = result.model
    shown = low_passed(model.presses).window(0.03, 0.03)
    colourings, lines = usual_colourings(model), [Line("measured", local(shown, shown.force), "measured")]
    selected = 0
    if result.sites is not None and result.modulus is not None:
        force = forces_at(
            result.sites,
            shown.displacement,
            shown.starts,
            young_modulus_pa=result.modulus.modulus_pa,
            tip_radius_m=shown.tip_radius_m,
            law=result.modulus.press.law,
        )
        lines.append(Line("model with one modulus", local(shown, force)))
        each = rms_by_press(shown, force - shown.force)
        words = (
            "Model less measured, root mean square over each press, which the modulus was fitted to; between "
            "presses what is near."
        )
        colourings.insert(1, Colouring(ERROR, None, each, words))
        selected = int(np.argmax(each))
    return view_of_presses(model, shown, colourings, lines, selected)


def object_figure(model: Model) -> Figure:
    """First touches and fixed base; the modulus of single presses over the surface."""
    figure, axes = subplots(1, 2, figsize=(10, 4.2))
    draw_touched(axes[0], model)
    own = model.presses.fits["e_pa"]
    if np.isfinite(own).any():
        values = own[np.isfinite(own)] * MODULUS.scale
        limits = MODULUS.limits(values.min(), values.max())
        colours = Colours(over_surface(model, own * MODULUS.scale), MODULUS, limits)
        draw_object(axes[1], model, colours, touches=model.presses.point[np.isfinite(own)])
    else:
        axes[1].set_axis_off()
    return figure


def _figures(result: Reconstruction, beside: dict[str, Model]) -> dict[str, Figure]:
    models = {result.exploration.recording.name: result.model, **beside}
    figures = exploration_figures(result)
    figures["object"] = object_figure(result.model)
    figures["figure-4"] = undamped_figure(models)
    figures["figure-5"] = spatial_figure(
        result.model, result.exploration.recording.name, next(iter(beside.items()), None)
    )
    figures["figure-6"] = moduli_figure(models)
    report = result.meshing.report
    quality, axes = subplots(1, 3, figsize=(12, 2.8))
    quality_histogram(axes[0], report.radius_edge_ratio, "radius-edge ratio", 2.0)
    quality_histogram(
        axes[1], report.edge_m * 1e3, "edge length [mm]", result.model.mesh_size_m * 1e3, "wanted"
    )
    quality_histogram(axes[2], report.surface_distance_m * 1e3, "distance to the surface [mm]", 2.0)
    figures["figure-mesh"] = quality
    if result.modulus and result.modulus.by_depth:
        figures["figure-depth"] = depth_figure(result.modulus)
    return figures


def tell(result: Reconstruction, page: Page, picture: Figure | None = None) -> None:
    """The answer, the object, and how it came about, into a page. picture: `object_figure`'s."""
    model = result.model
    low, high = model.material.young_modulus_ci95_pa
    first = lost(result)
    page.lead(
        f"{first[:1].upper()}{first[1:]}{len(model.presses)} presses became a model of "
        f"{model.material.young_modulus_pa / 1e3:.1f} kPa "
        f"(Young's modulus; 95 % sure: {low / 1e3:.1f} to {high / 1e3:.1f} kPa)."
    )
    page.paragraph(meaning(result))
    page.next_steps(next_steps(result))
    for finding in result.findings:
        page.paragraph(finding.line())
    page.view(
        view(result), picture or object_figure(result.model),
        "Left: first touches and fixed base. Right: the modulus of single presses, and where.",
        result.model,
    )  # fmt: skip
    _how(page, result)


def next_steps(result: Reconstruction) -> list[str]:
    """What to do with the model."""
    where = file_words(result.model.path, "MODEL")
    recording = file_words(result.exploration.recording.path, "REC")
    return [
        f"feel it: `palpate touch {where}`",
        f"see what it leaves out: `palpate diagnose {recording} --model {where} --report PAGE.html`",
    ]


def lost(result: Reconstruction) -> str:
    """That a 1D model predicts places better that were held out, and what may help, before what else is said;
    '' where none does."""
    told = result.held_out
    if told is None or not told.beaten_by:
        return ""
    one = result.model.provenance["options"]["modulus_field"]["field"] == "homogeneous"
    return (
        f"{told.beaten_by}, a 1D model, errs by {1e3 * told.floor_n:.2g} mN on places that were held out and "
        f"this model by {1e3 * told.model_n:.2g} mN{' (--field auto may help)' if one else ''}; "
    )


def meaning(result: Reconstruction) -> str:
    """What the modulus and its interval mean, in a sentence or two."""
    model = result.model
    e, (low, high) = model.material.young_modulus_pa, model.material.young_modulus_ci95_pa
    words = f"About as soft as {softness(e)}."
    if np.isfinite([low, high]).all():
        words += (
            f" Another exploration of the same object would be expected to find a modulus within "
            f"{100 * max(high / e - 1, 1 - low / e):.0f} % of this one."
        )
    if result.modulus:
        misfit = float(np.sqrt((result.modulus.press.rms_n**2).mean()))
        words += f" One number for the whole object leaves {1e3 * misfit:.0f} mN of a press unexplained."
    return words


def least_known(surface: Surface) -> str:
    """How well a shape is known, and where to press to know it better, in words; standard deviations."""
    (x, y, z), sd_m = surface.least_known
    usual_m = float(np.median(surface.uncertainty_m[surface.above_base]))
    return (
        f"known within {1e3 * usual_m:.2g} mm (median), least at ({1e3 * x:.0f}, {1e3 * y:.0f}, "
        f"{1e3 * z:.0f}) mm, within {1e3 * sd_m:.2g} mm: press there to know it better"
    )


def _how(page: Page, result: Reconstruction) -> None:
    surface = result.surface
    known = f" It is {least_known(surface)}." if surface.shape is None else ""
    page.paragraph(
        f"Shape: {surface.method}; {surface.reason}.{known} Volume {surface.volume_m3 * 1e6:.1f} cm³. The "
        f"sensor's noise is {result.exploration.noise_n * 1e3:.1f} mN an axis. "
        + (
            "The method is the paper's own."
            if paper_remade(result)
            else "The method takes the tip's size into account, where the paper presses with a point."
        )
    )
    if result.modulus:
        fit = result.modulus
        page.paragraph(
            f"The modulus: {fit.reason}. From place to place it differs by "
            f"{100 * fit.between:.1f} %; what is not known of the shape makes it uncertain by another "
            f"{100 * fit.shape_error:.2f} %. Which law is best was asked again of places drawn at random; "
            "the last column says how often it was each."
        )
        page.table(
            ["dent law", "modulus [kPa]", "not explained of a press [mN]", "best in so many draws"],
            [
                [name, e / 1e3, f"{1e3 * misfit:.1f}", f"{100 * share:.0f} %"]
                for name, (e, misfit, share) in fit.by_law.items()
            ],
        )


def _not_used(page: Page, result: Reconstruction) -> None:
    rows = [*result.exploration.rejected, *(result.paper_fit.not_used if result.paper_fit else ())]
    if rows:
        page.paragraph(f"Contacts not used ({len(rows)}):")
        page.table(["at [s]", "why"], [[float(t), reason] for t, reason in rows])


def _mesh_words(result: Reconstruction) -> str:
    report = result.meshing.report
    within = 100 * np.mean(report.radius_edge_ratio <= 2)
    return (
        f"Quality of the {len(result.meshing.mesh.tetrahedra)} tetrahedra: {within:.1f} % within a "
        f"radius-edge ratio of 2 (greatest {report.radius_edge_ratio.max():.2f}); greatest distance between "
        f"mesh and surface {report.surface_distance_m.max() * 1e3:.2f} mm; volume "
        f"{report.volume_m3 * 1e6:.1f} of {report.surface_volume_m3 * 1e6:.1f} cm³."
    )
