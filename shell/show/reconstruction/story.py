"""The story of a reconstruction: the model and how it came about; then the paper's figures and table, remade
from a recording, beside its numbers."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from palpate.mechanics.contact.touch import forces_at
from palpate.mechanics.effects import stiffness_field
from palpate.mechanics.model.model import Model
from palpate.mechanics.presses.table import Presses
from palpate.operations._written import open_words
from palpate.reconstruction.checks.finding import OF_A_SHAPE, Way
from palpate.reconstruction.pipeline import Reconstruction
from palpate.reconstruction.steps.s4_surface import Surface
from palpate.reconstruction.steps.s6_one_d import low_passed
from palpate.show import story as say
from palpate.show.model import local, rms_by_press, usual_colourings, view_of_presses
from palpate.show.page import feel_step, file_words, subplots
from palpate.show.quantities import AS_RECORDED, ERROR, MODULUS, softness
from palpate.show.reconstruction.differences import differences, trend_words
from palpate.show.reconstruction.exploration import damped_figure, geometry_figure, touches_figure
from palpate.show.reconstruction.modulus import (
    depth_figure,
    height_trends,
    mesh_figure,
    moduli_figure,
    over_surface,
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
from palpate.words import counted, gathered, kpa, mm, mn, percent, place_mm, sure_kpa

if TYPE_CHECKING:
    from matplotlib.figure import Figure


def story(result: Reconstruction, beside: dict[str, Model] | None = None) -> say.Story:
    """The answer, the object, how it came about; then the paper's figures and tables, remade.

    beside: other models by name, drawn beside in Figures 4 and 6 and in Table 1.
    """
    yield say.Title(f"Reconstruction of {result.exploration.recording.name}", suffixed=True, pictures="own")
    model, exploration = result.model, result.exploration
    presses = f"{len(exploration.presses)} presses"
    modulus, ends = model.material.young_modulus_pa, model.material.young_modulus_ci95_pa
    if result.doubt:
        yield say.Headline(f"not reliable: {result.doubt}", on=say.TEXT)
        yield say.Headline(f"Not reliable: {result.doubt.partition(': ')[0]}", on=say.PAGE)
        yield say.Sentence(result.doubt, on=say.PAGE)
    sure, surely = ("not to be believed",) * 2 if result.doubt else (sure_kpa(ends), sure_kpa(ends, ".1f"))
    yield say.Headline(
        f"{exploration.recording.name}: {presses}, Young's modulus {kpa(modulus)} ({sure})", on=say.TEXT
    )
    became = f"{presses} became a model of {kpa(modulus, '.1f')} (Young's modulus; {surely})"
    yield (say.Sentence if result.doubt else say.Headline)(became, on=say.PAGE)
    yield from (say.Detail(words) for words in _taken_as(result))
    yield from _meant(result)
    yield say.Next(next_steps(result))
    for finding in result.findings:
        yield say.TextLine(finding.line())
        yield say.Detail(finding.line(), on=say.PAGE)
    yield from _made(result)
    yield say.Turned(
        lambda: view(result),
        say.Picture(
            lambda: object_figure(model),
            "Left: first touches and fixed base. Right: the modulus of single presses, and where.",
            name="object",
        ),
        model,
    )
    yield say.Section("How was it made, and how sure is it?", _how(result))
    yield say.Section("How does it look in the paper's figures?", _paper(result, beside), evidence=True)


def _paper(result: Reconstruction, beside: dict[str, Model] | None) -> say.Story:
    """The figures and tables of the paper, remade."""
    model, exploration = result.model, result.exploration
    models, name = {exploration.recording.name: model, **(beside or {})}, exploration.recording.name
    yield say.Section("Exploration and geometry", _explored(result))
    yield say.Section("1D models", _one_d(result, models))
    other = next(iter((beside or {}).items()), None)
    yield say.Section("Where the parameters hold", _places(result, name, other))
    yield say.Section("Modulus", _modulus(result, models, beside or {}))
    yield say.Section("Where this differs from the paper, and why", _differs(result))


def _taken_as(result: Reconstruction) -> Iterator[str]:
    """What else than a tip that sticks and one modulus was taken, as the presses ask for it."""
    if result.slides:
        yield (
            f"the tip slides: its sideways force is {percent(result.sideways)} of a stuck one's, "
            "so the modulus is by the force along the normal alone; `palpate diagnose` tells the friction"
        )
    if field := result.model.effects.get(stiffness_field.EFFECT.name):
        low, high = (kpa(result.young_modulus_pa * float(f(field["ratio"]))) for f in (np.min, np.max))
        yield (
            f"the modulus differs from place to place, {low} to {high}: held-out places are predicted better "
            "than by one (--field homogeneous gives one)"
        )


def _taken(result: Reconstruction) -> str:
    """What the modulus rests on that nobody measured: Poisson's ratio and the tip, and who said them."""
    model, recording = result.model, result.recording
    ratio, said = model.material.poisson_ratio, recording.poisson_ratio
    who = "as the recording says" if ratio == said else "as stated"
    if said is None and result.model.provenance["options"].get("poisson_ratio") is None:
        who = "assumed: --poisson-ratio sets another"
    form = " (its form assumed: --tip states another)" if recording.tip_assumed else ""
    tip = f"a sphere of {mm(model.tool.tip_radius_m, 'g')} radius{form}"
    return f"for Poisson's ratio {ratio:.3g} ({who}), under {tip}"


def _of_other_tips(result: Reconstruction) -> Iterator[str]:
    """What the modulus would be under a tip that the first touches leave open."""
    each = (
        f"{mm(tip.radius_m)} would read as {kpa(tip.young_modulus_pa, '.1f')} (presses fit "
        f"{percent(abs(tip.misfit - 1))} {'better' if tip.misfit < 1 else 'worse'})"
        for tip in result.other_tips
    )
    if result.other_tips:
        yield f"It rests on the tip's stated radius, which first touches leave open: {', '.join(each)}"


def _meant(result: Reconstruction) -> say.Story:
    yield say.Detail(_taken(result), on=say.TEXT)
    yield from map(say.Detail, _of_other_tips(result))
    if not result.doubt:
        words = meaning(result)
        yield from (say.Detail(said.removesuffix("."), on=say.TEXT) for said in words.split(". "))
        yield say.Detail(words, on=say.PAGE)
    yield say.Sentence(f"This holds {_taken(result)}", on=say.PAGE)


def _made(result: Reconstruction) -> say.Story:
    """How it came about, in a terminal's lines."""
    exploration, surface, mesh = result.exploration, result.surface, result.model.mesh
    not_used = _not_used(result)
    used = len(result.model.presses)
    yield say.TextLine(f"contacts: {used + len(not_used)} found, {used} used")
    if not_used:
        causes = ", ".join(f"{reason} ({n})" for reason, n in gathered(reason for _, reason in not_used))
        yield say.TextLine(
            f"{counted(len(not_used), 'contact')} not used: {causes} (--json names each with its time)"
        )
    if result.modulus:
        yield say.TextLine(f"modulus: {result.modulus.reason}")
    if result.exact:
        by_table = kpa(result.exact.by_table.modulus_pa)
        yield say.Detail(
            f"by the law's table it would be {by_table} ({result.exact.presses.said})", on=say.TEXT
        )
    if exploration.delay_s:
        yield say.TextLine(
            f"the force reads {exploration.delay_s * 1e3:.0f} +- {exploration.delay_error_s * 1e3:.1f} "
            "ms late (first against last touch); corrected before everything else"
        )
    yield from (say.TextLine(dropped) for dropped in exploration.dropped)
    yield say.TextLine(f"surface: {surface.method}, {surface.volume_m3 * 1e6:.1f} cm³; {surface.reason}")
    if shaped_by_touches(result):
        yield say.Detail(least_known(surface), on=say.TEXT)
    yield from (say.Detail(note, on=say.TEXT) for note in (result.placed.notes if result.placed else ()))
    off = mm(result.meshing.report.surface_distance_m.max(), ".2f")
    yield say.TextLine(
        f"mesh: {len(mesh.tetrahedra)} tetrahedra of {mm(result.model.mesh_size_m, 'g')} ({len(mesh.points)} "
        f"nodes), at most {off} off the surface"
    )


def _explored(result: Reconstruction) -> say.Story:
    yield say.Sentence(
        "The figures and tables of the paper whose method this is, remade from this recording "
        "(Goksel, Jeon, Harders and Székely, Deformable Haptic Model Generation Through Manual Exploration)."
    )
    yield say.Picture(
        lambda: touches_figure(result),
        "Force magnitude, first touches (o) and peaks (+) (the paper's Figure 2).",
        name="figure-2",
    )
    yield say.Picture(
        lambda: geometry_figure(result),
        "(a) First touches (+) and base outline with its farthest-point sample (o); (b) mesh, fixed base "
        "nodes and the nodes nearest to the contacts, in order; (c) force over depth of every palpation (the "
        "paper's Figure 3).",
        name="figure-3abc",
    )
    if rows := _not_used(result):
        yield say.Sentence(f"Contacts not used ({len(rows)}):")
        yield say.Rows(["at [s]", "why"], [[float(t), reason] for t, reason in rows])
    yield say.Picture(lambda: mesh_figure(result), _mesh_words(result), name="figure-mesh")


def _one_d(result: Reconstruction, models: dict[str, Model]) -> say.Story:
    yield say.Picture(
        lambda: damped_figure(result),
        "A spring k and a damper b for each press: proportional to depth (Kelvin–Voigt, KV), or to a power r "
        "of it (Hunt–Crossley, HC); a dot is a press (the paper's Figure 3(d)).",
        name="figure-3d",
    )
    yield say.Picture(
        lambda: undamped_figure(models),
        "The same without the damper: (a) k_V, a spring alone; (b, c) k_C, one of a power r of depth; (d) "
        "k_H, the same at the mean power of all presses (the paper's Figure 4).",
        name="figure-4",
    )
    yield from one_d_table(result)


def _places(result: Reconstruction, name: str, other: tuple[str, Model] | None) -> say.Story:
    yield say.Picture(
        lambda: spatial_figure(result.model, name, other),
        "Above, k_V over the surface (radial basis functions through the presses, dots); below, k_V, k_H and "
        "e over height on the side, relative to their means and on one scale (the paper's Figure 5).",
        name="figure-5",
    )
    yield from trends_table(height_trends(result.model))
    if words := trend_words(result):
        yield say.Sentence(words)


def _modulus(result: Reconstruction, models: dict[str, Model], beside: dict[str, Model]) -> say.Story:
    yield say.Picture(
        lambda: moduli_figure(models),
        "(a) Moduli of single palpations, * the global one with its 95 % interval; (b) where (the paper's "
        "Figure 6).",
        name="figure-6",
    )
    yield say.Rows(*table_one(result, beside))
    fit = result.modulus
    if fit and fit.by_depth:
        yield say.Picture(
            lambda: depth_figure(fit),
            "Global modulus from samples up to a greatest depth.",
            name="figure-depth",
        )
    yield from point_load_table(result)


def _differs(result: Reconstruction) -> say.Story:
    yield from map(say.Sentence, differences(result))
    yield from speed_table(result)


def view(result: Reconstruction) -> View:
    """The object; each press as measured and as the model with its one modulus answers the same path."""
    model = result.model
    shown = _shown(result)
    colourings, lines = usual_colourings(model), [Line("measured", local(shown, shown.force), "measured")]
    selected = 0
    force = _with_one_modulus(result, shown)
    if force is not None:
        lines.append(Line("model with one modulus", local(shown, force)))
        each = rms_by_press(shown, force - shown.force)
        words = (
            "Model less measured, root mean square over each press, which the modulus was fitted to; between "
            "presses what is near."
        )
        colourings.insert(1, Colouring(ERROR, None, each, words, name=AS_RECORDED))
        selected = int(np.argmax(each))
    return view_of_presses(model, shown, colourings, lines, selected)


def _shown(result: Reconstruction) -> Presses:
    fitted = result.model.presses if result.fitted_presses is None else result.fitted_presses
    return low_passed(fitted).window(0.03, 0.03)


def _with_one_modulus(result: Reconstruction, shown: Presses) -> np.ndarray | None:
    """(n, 3) N at the rows of presses: the model's force with its one modulus; None where it has none."""
    if result.sites is None or result.modulus is None:
        return None
    return forces_at(
        result.sites,
        shown.displacement,
        shown.starts,
        young_modulus_pa=result.modulus.modulus_pa,
        tip_radius_m=shown.tip_radius_m,
        law=result.modulus.press.law,
    )


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


def next_steps(result: Reconstruction) -> list[str]:
    """What to do with the model; first what may mend it."""
    recording = file_words(result.exploration.recording.path, "REC")
    where = file_words(result.model.path, "MODEL")
    given = {"files": (result.exploration.recording,), "save": where}
    ways = [f"{way.says}: `{open_words(given, way.options)}`" for way in mending(result)]
    feel = feel_step(result.model.path, f"palpate reconstruct {recording} -o MODEL")
    left_out = f"see what it leaves out: `palpate diagnose {recording} --model {where} --report PAGE.html`"
    return as_far_as_believed(result, ways, feel, left_out)


def as_far_as_believed(result: Reconstruction, ways: list[str], feel: str, left_out: str) -> list[str]:
    """Steps that can be proposed: ways to mend it; of a shape that is another object's nothing else, and what
    does not predict is looked into, not kept."""
    if result.placed is not None and result.placed.doubt:
        return ways
    return [*ways, left_out] if result.doubt else [*ways, feel, left_out]


def mending(result: Reconstruction) -> list[Way]:
    """Ways to an answer that can be relied on: another geometry where touches lie off the flat one that was
    given, another way up of a shape's file whose model does not predict, a field of the modulus where one is
    beaten by a 1D model."""
    ways: list[Way] = []
    held_out = result.held_out
    made = result.model.provenance["options"]
    if result.placed is not None and result.placed.likelier_radius_m:
        radius = result.placed.likelier_radius_m
        ways.append(Way(f"the radius is {1e3 * radius:.3g} mm", {"tip_radius_m": radius}))
    elif result.placed is not None and result.placed.doubt:
        ways += OF_A_SHAPE
    elif result.doubt and result.placed is not None and "file" in result.placed.about:
        up = "-z" if made["geometry"]["up"] != "-z" else "+z"
        ways.append(Way(f"its file stands another way, here {up} up", {"up": up}))
    one = made["modulus_field"]["field"] == "homogeneous"
    if one and held_out is not None and held_out.beaten_by:
        ways.append(Way("let the modulus differ from place to place", {"field": "auto"}))
    return ways


_LOST = 0.05
"""Share of a press's work that does not come back, from which it is said: elastic recordings lose 0.2 %."""


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
    shown = _shown(result)
    if (lost := shown.net.lost_work) > _LOST:
        words += (
            f" Of a press's work {100 * lost:.0f} % does not come back, so it holds for presses as fast as "
            "these: `palpate diagnose` tells what of it lasts."
        )
    force = _with_one_modulus(result, shown)
    if force is not None:
        misfit = float(np.sqrt((rms_by_press(shown, force - shown.force) ** 2).mean()))
        words += f" With one modulus for the whole object, a press's force is off by {mn(misfit)} (rms)."
    return words


def shaped_by_touches(result: Reconstruction) -> bool:
    """Whether the surface goes by the touches alone, so that another one would tell more of it."""
    return result.placed is None and result.surface.shape is None


def least_known(surface: Surface) -> str:
    """How well a shape is known, and where to press to know it better, in words; standard deviations."""
    place, sd_m = surface.least_known
    usual_m = float(np.median(surface.uncertainty_m[surface.above_base]))
    return (
        f"known within {mm(usual_m, '.2g')} (median), least at {place_mm(place)}, within {mm(sd_m, '.2g')}: "
        "press there to know it better"
    )


def _how(result: Reconstruction) -> say.Story:
    surface = result.surface
    known = f" It is {least_known(surface)}." if shaped_by_touches(result) else ""
    method = "The method takes the tip's size into account, where the paper presses with a point."
    if paper_remade(result):
        method = "The method is the paper's own."
    yield say.Detail(
        f"Shape: {surface.method}; {surface.reason}.{known} Volume {surface.volume_m3 * 1e6:.1f} cm³. The "
        f"sensor's noise is {mn(result.exploration.noise_n, '.1f')} an axis. {method}"
    )
    if result.modulus:
        fit = result.modulus
        yield say.Sentence(
            f"The modulus: {fit.reason}. From place to place it differs by "
            f"{100 * fit.between:.1f} %; what is not known of the shape makes it uncertain by another "
            f"{100 * fit.shape_error:.2f} %. The best law was chosen again from places drawn at random; "
            "the last column says how often it was each."
        )
        yield say.Rows(
            ["dent law", "modulus [kPa]", "best in so many draws"],
            [[name, e / 1e3, f"{100 * share:.0f} %"] for name, (e, _, share) in fit.by_law.items()],
        )


def _not_used(result: Reconstruction) -> list[tuple[float, str]]:
    return [*result.exploration.rejected, *(result.paper_fit.not_used if result.paper_fit else ())]


def _mesh_words(result: Reconstruction) -> str:
    report = result.meshing.report
    within = 100 * np.mean(report.radius_edge_ratio <= 2)
    return (
        f"Quality of the {len(result.meshing.mesh.tetrahedra)} tetrahedra: {within:.1f} % within a "
        f"radius-edge ratio of 2 (greatest {report.radius_edge_ratio.max():.2f}); greatest distance between "
        f"mesh and surface {mm(report.surface_distance_m.max(), '.2f')}; volume "
        f"{report.volume_m3 * 1e6:.1f} of {report.surface_volume_m3 * 1e6:.1f} cm³."
    )


def _surface(result: Reconstruction) -> dict[str, Any]:
    where, sd_m = result.surface.least_known
    return {**say.figures_of(result.surface, ("method", "reason", "volume_m3")),
            "least_known_at_m": where, "least_known_sd_m": sd_m}  # fmt: skip


def _mesh(result: Reconstruction) -> dict[str, Any]:
    report = result.meshing.report
    return {
        "radius_edge_ratio": _percentiles(report.radius_edge_ratio),
        "surface_distance_m": _percentiles(report.surface_distance_m),
        "volume_m3": report.volume_m3,
    }


def _percentiles(values: np.ndarray) -> dict[str, float]:
    return {name: float(np.percentile(values, at)) for name, at in (("p50", 50), ("p95", 95), ("max", 100))}


def _held_out(result: Reconstruction) -> dict[str, Any]:
    held_out = result.held_out
    floor = held_out is not None and bool(held_out.floor)
    return {
        "held_out_rmse_n": held_out.model_n if held_out else None,
        "held_out_constant_rmse_n": held_out.constant_n if held_out else None,
        "held_out_floor": held_out.floor if held_out and floor else None,
        "held_out_floor_rmse_n": held_out.floor_n if held_out and floor else None,
        "beaten_by": (held_out.beaten_by or None) if held_out else None,
    }


_LAW = ("young_modulus_pa", "misfit_n", "share")
_DEPTH = ("depth_m", "young_modulus_pa", "consistent")
_TIP: tuple[say.Key, ...] = ("radius_m", "young_modulus_pa", "misfit_ratio=misfit")
_FIT: tuple[say.Key, ...] = (
    "dent_law=press.law",
    ("by_law", lambda fit: {law: dict(zip(_LAW, row, strict=True)) for law, row in fit.by_law.items()}),
    ("by_depth", lambda fit: [dict(zip(_DEPTH, row, strict=True)) for row in fit.by_depth]),
    "between_sites=between",
    "shape_error",
)


def _how_fitted(result: Reconstruction) -> dict[str, Any]:
    found = say.figures_of(result.modulus, _FIT) if result.modulus else {}
    if exact := result.exact:
        by_table = {"young_modulus_by_table_pa": exact.by_table.modulus_pa}
        found["exact"] = {**by_table, **exact.presses.as_json()}
    if result.paper_fit:
        found["not_used"] = _contacts(result.paper_fit.not_used)
    return found


def _contacts(rejected: Sequence[tuple[float, str]]) -> list[dict[str, Any]]:
    return [{"t_s": t, "reason": reason} for t, reason in rejected]


KEYS: tuple[say.Key, ...] = (
    ("method", lambda result: result.model.provenance["method"]),
    "young_modulus_pa=model.material.young_modulus_pa",
    "young_modulus_ci95_pa=model.material.young_modulus_ci95_pa",
    "poisson_ratio=model.material.poisson_ratio",
    ("palpations", lambda result: len(result.exploration.presses)),
    ("rejected", lambda result: _contacts(result.exploration.rejected)),
    "findings",
    "doubt",
    "sideways_share=sideways",
    ("other_tips", lambda result: [say.figures_of(tip, _TIP) for tip in result.other_tips]),
    _held_out,
    "noise_n=exploration.noise_n",
    "force_delay_s=exploration.delay_s",
    "force_delay_sd_s=exploration.delay_error_s",
    "dropped_corrections=exploration.dropped",
    ("surface", _surface),
    (
        "geometry",
        lambda result: {**result.placed.about, "notes": result.placed.notes} if result.placed else None,
    ),
    ("mesh", _mesh),
    "press_modulus_pa",
    "seconds",
    _how_fitted,
)
