"""The report of a reconstruction: the paper's figures and table, remade from a recording, beside its
numbers."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from matplotlib import pyplot as plt
from matplotlib.figure import Figure

from mechanics.model import Model
from palpate.report.differences import differences
from palpate.report.exploration_figures import exploration_figures
from palpate.report.modulus_figures import (
    Trend,
    depth_figure,
    height_trends,
    moduli_figure,
    quality_histogram,
    spatial_figure,
    undamped_figure,
)
from palpate.report.page import Page, save_figures
from palpate.report.reconstruction_tables import (
    PAPER_SECONDS,
    one_d_comparison,
    point_load_rows,
    table_one,
)
from reconstruct.pipeline import Reconstruction


def write_report(path: Path | str, result: Reconstruction, beside: dict[str, Model] | None = None) -> Path:
    """Write the page, and its figures as PNGs into the folder PATH without suffix; returns the page's path.

    A path without suffix gets '.html': its own name is the folder's.
    beside: other models by name, drawn beside in Figures 4 and 6 and in Table 1.
    """
    path = Path(path)
    path = path if path.suffix else path.with_suffix(".html")
    figures = _figures(result, beside or {})
    save_figures(path.with_suffix(""), figures)
    page = Page(f"Reconstruction of {result.exploration.recording.name}")
    _summary(page, result)
    page.heading("Exploration and geometry")
    page.figure(figures["figure-2"], "Figure 2: force magnitude, first touches (o) and peaks (+).")
    page.figure(
        figures["figure-3abc"],
        "Figure 3: (a) first touches (+) and base outline with its farthest-point sample (o); (b) mesh, "
        "fixed "
        "base nodes and the nodes nearest to the contacts, in order; (c) force over depth of every "
        "palpation.",
    )
    _not_used(page, result)
    page.figure(figures["figure-mesh"], _mesh_words(result))
    page.heading("1D models")
    page.figure(figures["figure-3d"], "Figure 3(d): Kelvin-Voigt and Hunt-Crossley parameters.")
    page.figure(figures["figure-4"], "Figure 4: without damping; k_H at the mean exponent.")
    _one_d(page, result)
    page.heading("Where the parameters hold")
    page.figure(
        figures["figure-5"],
        "Figure 5: k_V over the surface (radial basis functions through the presses, dots); below k_V, "
        "k_H and e "
        "over height on the side, the line is the global modulus.",
    )
    _trends(page, height_trends(result.model))
    page.heading("Modulus")
    page.figure(
        figures["figure-6"], "Figure 6: (a) moduli of single palpations, * the global one; (b) where."
    )
    page.table(*table_one(result, beside or {}))
    if "figure-depth" in figures:
        page.figure(figures["figure-depth"], "Global modulus from samples up to a greatest depth.")
    _point_load(page, result)
    page.heading("Where this differs from the paper, and why")
    for words in differences(result):
        page.paragraph(words)
    _speed(page, result)
    return page.write(path)


def _figures(result: Reconstruction, beside: dict[str, Model]) -> dict[str, Figure]:
    models = {result.exploration.recording.name: result.model, **beside}
    figures = exploration_figures(result)
    figures["figure-4"] = undamped_figure(models)
    figures["figure-5"] = spatial_figure(
        result.model, result.exploration.recording.name, next(iter(beside.items()), None)
    )
    figures["figure-6"] = moduli_figure(models)
    report = result.meshing.report
    quality, axes = plt.subplots(1, 3, figsize=(12, 2.8), layout="constrained")
    quality_histogram(axes[0], report.radius_edge_ratio, "radius-edge ratio", 2.0)
    quality_histogram(
        axes[1], report.edge_m * 1e3, "edge length [mm]", result.model.mesh_size_m * 1e3, "wanted"
    )
    quality_histogram(axes[2], report.surface_distance_m * 1e3, "distance to the surface [mm]", 2.0)
    figures["figure-mesh"] = quality
    if result.modulus and result.modulus.by_depth:
        figures["figure-depth"] = depth_figure(result.modulus)
    return figures


def _summary(page: Page, result: Reconstruction) -> None:
    model, surface = result.model, result.surface
    low, high = model.material.young_modulus_ci95_pa
    page.lead(
        f"Young's modulus {model.material.young_modulus_pa / 1e3:.2f} kPa, 95 % interval {low / 1e3:.2f} to "
        f"{high / 1e3:.2f} kPa, from {len(model.presses)} palpations (method "
        f"{model.provenance['method']})."
    )
    page.paragraph(
        f"Surface: {surface.method} ({surface.reason}); volume {surface.volume_m3 * 1e6:.1f} cm^3. "
        f"Force noise {result.exploration.noise_n * 1e3:.1f} mN an axis."
    )
    if result.modulus:
        fit = result.modulus
        page.paragraph(
            f"{fit.reason[0].upper()}{fit.reason[1:]}. Spread between sites {100 * fit.between:.1f} %; the "
            f"shape's uncertainty makes {100 * fit.shape_error:.2f} % of the modulus's standard error."
        )
        page.table(
            ["dent law", "modulus [kPa]", "misfit of a press [N]", "chosen by resamples"],
            [
                [name, e / 1e3, misfit, f"{100 * share:.0f} %"]
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
        f"radius-edge "
        f"ratio of 2 (greatest {report.radius_edge_ratio.max():.2f}); greatest distance between mesh and "
        f"surface "
        f"{report.surface_distance_m.max() * 1e3:.2f} mm; volume {report.volume_m3 * 1e6:.1f} of "
        f"{report.surface_volume_m3 * 1e6:.1f} cm^3."
    )


def _one_d(page: Page, result: Reconstruction) -> None:
    page.paragraph("The paper's estimators and the robust ones, medians over the palpations:")
    page.table(*one_d_comparison(result))


def _trends(page: Page, trends: list[Trend]) -> None:
    if not trends:
        page.paragraph("Fewer than five presses on the side: no trend with height can be told.")
        return
    page.paragraph(
        f"Correlation with height over {trends[0].presses} presses on the side: the 1D stiffness follows "
        f"the height, "
        "the modulus should not."
    )
    page.table(
        ["parameter", "Pearson r", "p", "Spearman", "p", "change over the height"],
        [
            [t.name, t.pearson, t.pearson_p, t.spearman, t.spearman_p, f"{100 * t.change:+.1f} %"]
            for t in trends
        ],
    )


def _point_load(page: Page, result: Reconstruction) -> None:
    page.paragraph(
        "Why the paper's modulus depends on the mesh: displacement of a loaded node per newton (linear "
        "tetrahedra) "
        "as the mesh is refined near the surface, beside that of a load spread over a patch (quadratic "
        "tetrahedra)."
    )
    page.table(
        ["surface edge [mm]", "nodes (linear)", "point load, linear [mm/N]", "patch, quadratic [mm/N]"],
        point_load_rows(result),
    )


def _speed(page: Page, result: Reconstruction) -> None:
    total = sum(result.seconds.values())
    rows = [
        [name, seconds, PAPER_SECONDS.get(name, float("nan"))] for name, seconds in result.seconds.items()
    ]
    page.paragraph("Wall time of the steps on this machine, and what the paper states:")
    page.table(["step", "seconds", "paper [s]"], [*rows, ["whole", total, PAPER_SECONDS["whole"]]])
