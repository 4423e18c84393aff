"""The effects of a model that are rendered: what its keys mean to the step. Laws: mechanics.effects.

Effects of the material's layout and of the base (inclusion, gradient, skin, Poisson's ratio, boundary) are in
the model's mesh, moduli and compliance already. Effects of the instrument are corrections of a recording and
are never rendered.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from mechanics.dent import DentLaw, dent_law
from mechanics.effects.mullins_softening import dent_energy
from mechanics.effects.skin_layer import skinned
from mechanics.effects.strain_stiffening import stiffened
from mechanics.effects.viscoelasticity import prony_series
from mechanics.errors import ModelError
from mechanics.model import Model
from render.options import RenderOptions

RENDERED = (
    "finite_strain",
    "strain_stiffening",
    "viscoelasticity",
    "mullins_softening",
    "tip_radius",
    "friction_slip",
    "adhesion",
    "skin_layer",
)
"""Effects that a step renders by a law of its own."""


STICKING = 1.0
"""Enough for every press of a hand to stick, as the ideal tip does; a tip that is dragged along slides all
the same, where one that stuck for good would stretch the surface without bound."""


class EffectArrays(NamedTuple):
    """For the kernel. g, tau_s: (k,) Prony. mullins: (2,) r, m; r = 0: none. adhesion: (3,) pull-off N, range
    m, share that holds deeper inside.

    dent_radius: (1,) factor on the tip's radius in the dent.
    """

    g: np.ndarray
    tau_s: np.ndarray
    mullins: np.ndarray
    adhesion: np.ndarray
    dent_radius: np.ndarray


def effect_arrays(model: Model, options: RenderOptions) -> EffectArrays:
    """The kernel's numbers; raises ModelError where an effect's keys are missing or impossible."""
    effects = dict(model.effects) if options.effects else {}
    g = tau = np.zeros(0)
    mullins, adhesion, dent_radius = np.zeros(2), np.zeros(3), np.ones(1)
    try:
        if "viscoelasticity" in effects:
            g, tau = prony_series(effects["viscoelasticity"])
        if "mullins_softening" in effects:
            keys = effects["mullins_softening"]
            known = model.presses.depth_m[np.isfinite(model.presses.depth_m)]
            deepest = float(known.max(initial=0.0)) or model.tool.tip_radius_m
            mullins = np.array([float(keys["r"]), float(keys["m_rel"]) * dent_energy(deepest)])
            _check(
                mullins[0] >= 1 and mullins[1] > 0, "mullins_softening", "r at least 1, m_rel greater than 0"
            )
        if "adhesion" in effects:
            keys = effects["adhesion"]
            adhesion = np.array(
                [float(keys["pull_off_n"]), float(keys["range_m"]), float(keys.get("inside", 0.0))]
            )
            _check(
                adhesion[0] >= 0 and adhesion[1] > 0 and 0 <= adhesion[2] <= 1,
                "adhesion",
                "pull_off_n at least 0, range_m above 0, inside from 0 to 1",
            )
        if "tip_radius" in effects:
            dent_radius = np.array([float(effects["tip_radius"]["tip_radius_m"]) / model.tool.tip_radius_m])
            _check(dent_radius[0] > 0, "tip_radius", "tip_radius_m greater than 0")
    except KeyError as error:
        raise ModelError(
            f"an effect of the model lacks its key {error}: diagnose the recording again"
        ) from error
    except (TypeError, ValueError) as error:
        raise ModelError(f"an effect of the model has a value that is no number: {error}") from error
    return EffectArrays(g.copy(), tau.copy(), mullins, adhesion, dent_radius)


def rendered_dent_law(model: Model, options: RenderOptions) -> DentLaw:
    """The options' law or else the material's, with what stiffens it: strain, and a skin (which is material,
    so that it stays where the options leave effects out)."""
    law, skin = dent_law(options.dent_law or model.material.dent_law), model.material.skin
    if options.effects and "strain_stiffening" in model.effects:
        law = stiffened(law, float(model.effects["strain_stiffening"]["c20_over_c10"]))
    if skin is not None:
        tip, nu = model.tool.tip_radius_m, model.material.poisson_ratio
        law = skinned(law, skin.thickness_m, skin.modulus_ratio, tip, nu)
    return law


def rendered_friction(model: Model, options: RenderOptions) -> float:
    """Coulomb's coefficient: the options', the model's friction_slip, or STICKING."""
    if options.friction is not None:
        return float(options.friction)
    if options.effects and "friction_slip" in model.effects:
        mu = float(model.effects["friction_slip"]["mu"])
        _check(mu >= 0, "friction_slip", "mu at least 0")
        return mu
    return STICKING


def _check(good: bool, name: str, allowed: str) -> None:
    if not good:
        raise ModelError(f"the model's effect {name} is impossible: allowed are {allowed}")
