"""Tables of a reconstruction's report: Table 1 of the paper, estimators of the 1D models, the point load's
mesh."""

from __future__ import annotations

from typing import Any

import numpy as np

from palpate.mechanics.compliance.patch import PatchSampler
from palpate.mechanics.compliance.sites import patch_compliance, patch_width
from palpate.mechanics.elastic.solver import Solver
from palpate.mechanics.model.model import Model
from palpate.mechanics.shape.refine import refined_near_surface, typical_edge
from palpate.reconstruction.pipeline import Reconstruction
from palpate.reconstruction.steps.s6_one_d import OneD, fit_paper, fit_robust, profiles
from palpate.reconstruction.steps.s7_modulus.modulus_paper import nearest_nodes
from palpate.show.reconstruction.modulus import Trend
from palpate.show.story import Rows, Sentence, Story
from palpate.words import chance_words

PAPER_TABLE = (
    ("paper #1", "cylinder radius 0.040 height 0.080", 29.0, 28.73),
    ("paper #2", "block 0.105 x 0.105 x 0.047", 16.0, 10.73),
    ("paper #3", "near half-sphere radius 0.060 height 0.055", 16.0, 11.31),
)
"""Table 1 of the paper: sample, geometry in metres, known and estimated modulus in kPa."""

PAPER_SECONDS = {"contacts": 10.0, "1D models": 0.5, "modulus": 3.0, "whole": 45.0}
"""The paper's own times, section 3, s (upper bounds)."""


def paper_remade(result: Reconstruction) -> bool:
    """Whether the paper's own method was asked for."""
    return result.model.provenance["method"] == "paper"


def table_one(result: Reconstruction, beside: dict[str, Model]) -> tuple[list[str], list[list[Any]]]:
    """Header and rows of Table 1: the paper's samples where it is remade, then ours, with the known modulus
    where it is stated."""
    header = [
        "sample",
        "geometry [m]",
        "known modulus [kPa]",
        "estimated modulus [kPa]",
        "95 % interval",
        "single presses [kPa]",
    ]
    rows: list[list[Any]] = [[*row, "", ""] for row in PAPER_TABLE] if paper_remade(result) else []
    truth = result.exploration.recording.truth or {}
    for name, model in {result.exploration.recording.name: result.model, **beside}.items():
        mine = model is result.model
        known = truth.get("young_modulus_pa", float("nan")) / 1e3 if mine else float("nan")
        each = model.presses.fits["e_pa"] / 1e3
        low, high = np.array(model.material.young_modulus_ci95_pa) / 1e3
        shape = truth.get("shape", "") if mine else model.about.get("shape", {}).get("surface", "")
        rows.append([
            name, str(shape), known, model.material.young_modulus_pa / 1e3,
            f"{low:.2f} to {high:.2f}", f"{np.nanmin(each):.1f} to {np.nanmax(each):.1f}",
        ])  # fmt: skip
    if not any(row[1] for row in rows) and not any(row[2] == row[2] for row in rows):
        return [header[0], *header[3:]], [[row[0], *row[3:]] for row in rows]  # nothing of them is known
    return header, rows


def one_d_comparison(result: Reconstruction) -> tuple[list[str], list[list[Any]]]:
    """Header and rows: the paper's estimators beside the bounded, robust ones; medians over the
    palpations."""
    presses, least = profiles(result.model.presses), result.exploration.noise_n
    rows = []
    for name, fit in (("paper, (3) to (6)", fit_paper), ("bounded, robust", fit_robust)):
        fits = fit(presses, least)
        median = _medians(fits)
        negative = 100 * float(np.mean([f.b_hc < 0 for f in fits]))
        slow = 100 * float(np.mean([f.valid for f in fits]))
        rows.append([name, *median, f"{negative:.0f} %", f"{slow:.0f} %"])
    header = [
        "estimator", "k_KV [N/m]", "b_KV [N s/m]", "k_HC [N/m^r]", "b_HC [N s/m^(r+1)]", "r", "misfit KV "
        "[N]", "misfit HC [N]", "b_HC < 0",
        "|v| < 0.1 k/b throughout",
    ]  # fmt: skip
    return header, rows


def _medians(fits: list[OneD]) -> list[float]:
    names = ("k_kv", "b_kv", "k_hc", "b_hc", "r_hc", "rms_kv_n", "rms_hc_n")
    return [float(np.nanmedian([getattr(f, n) for f in fits])) for n in names]


def point_load_rows(result: Reconstruction) -> list[list[Any]]:
    """Displacement of the loaded node per newton (mm/N) for linear tetrahedra refined near the surface, and
    of a load spread over a patch on quadratic ones: the first depends on the mesh, the second does not (NaN:
    not computed).

    The load is along the normal at the contact that is furthest from the base; patch of 8 mm width
    throughout.
    """
    model = result.model
    highest = int(np.argmax(model.presses.point @ model.support.normal))
    point, normal = model.presses.point[highest], model.presses.normal[highest]
    rows = []
    width = patch_width(result.meshing.mesh)
    scale = 1e3 / model.material.young_modulus_pa
    for edge, with_patch in ((1.0, True), (0.6 * model.mesh_size_m, True), (0.3 * model.mesh_size_m, False)):
        mesh, _ = refined_near_surface(result.meshing.mesh.linear(), edge)
        node = nearest_nodes(mesh, point[None])[0]
        load = np.zeros((len(mesh.points), 3))
        load[node] = normal
        linear = Solver(mesh, model.material.poisson_ratio).solve(load)[node] @ normal
        patch = float("nan")
        if with_patch:
            quadratic = Solver(mesh.quadratic(), model.material.poisson_ratio)
            weights = PatchSampler(quadratic.mesh, width).weights(point)
            patch = normal @ patch_compliance(quadratic, [weights])[0] @ normal
        rows.append([typical_edge(mesh) * 1e3, len(mesh.points), linear * scale, patch * scale])
    return rows


def one_d_table(result: Reconstruction) -> Story:
    yield Sentence("The paper's estimators and the robust ones, medians over the palpations:")
    yield Rows(*one_d_comparison(result))


_PARAMETERS = {"k_v": "stiffness k_V", "k_h": "stiffness k_H", "e_pa": "modulus e"}


def trends_table(trends: list[Trend]) -> Story:
    if not trends:
        yield Sentence("Fewer than five presses on the side: no trend with height can be determined.")
        return
    yield Sentence(
        f"Does a parameter go with the height of the {trends[0].presses} presses on the side? The stiffness "
        "of a 1D model does, since the glued base is near; a modulus should change little: see the last "
        "column. A correlation is 0 where they have nothing to do with one another, and 1 or -1 where one "
        "follows from the other; even a change of 1 % may correlate well."
    )
    yield Rows(
        [
            *("parameter", "correlation with height", "chance alone does this"),
            *("the same by rank", "chance alone does that", "change over the height"),
        ],
        [
            [
                *(_PARAMETERS[t.name], f"{t.pearson:+.2f}", chance_words(t.pearson_p)),
                *(f"{t.spearman:+.2f}", chance_words(t.spearman_p), f"{100 * t.change:+.1f} %"),
            ]
            for t in trends
        ],
    )


def point_load_table(result: Reconstruction) -> Story:
    yield Sentence(
        "Why the paper's modulus depends on the mesh: displacement of a loaded node per newton (linear "
        "tetrahedra) as the mesh is refined near the surface, and that of a load spread over a patch "
        "(quadratic tetrahedra)."
    )
    yield Rows(
        ["surface edge [mm]", "nodes (linear)", "point load, linear [mm/N]", "patch, quadratic [mm/N]"],
        point_load_rows(result),
    )


def speed_table(result: Reconstruction) -> Story:
    total = {**result.seconds, "whole": sum(result.seconds.values())}
    remade = paper_remade(result)
    rows: list[list[object]] = [
        [name, f"{seconds:.1f}", *([PAPER_SECONDS.get(name, float("nan"))] if remade else [])]
        for name, seconds in total.items()
    ]
    yield Sentence(
        "How long the steps took on this machine" + (", and what the paper states:" if remade else ":")
    )
    yield Rows(["step", "time [s]", *(["paper [s]"] if remade else [])], rows)
