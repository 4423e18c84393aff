"""A field of Young's modulus from presses: each press's own modulus, and how it answers to the elements'.

Every press is fitted by itself, its first touch a nuisance (`press_fit`); what its modulus says of
which element follows from the compliance's sensitivities (mechanics.compliance.field_response); the likeliest
smooth field of all presses follows from there (mechanics.compliance.smooth_field). The object stays of one
modulus where the evidence asks for no more: a field must be likelier than places that scatter at random, and
predict places that were left out.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from palpate.mechanics.compliance.field_response import far_in_field, shares_of, tips_of
from palpate.mechanics.compliance.pressed_places import Places, places_at
from palpate.mechanics.compliance.sites import TouchSites
from palpate.mechanics.compliance.smooth_field import (
    FieldEstimate,
    Shares,
    SmoothField,
    Views,
    estimate,
    lengths_of,
    places_of,
    views_of,
)
from palpate.mechanics.contact.edges import edge_law
from palpate.mechanics.contact.touch import forces_at
from palpate.mechanics.effects import stiffness_field
from palpate.mechanics.law_errors import DepthLaw, Level
from palpate.mechanics.model.model import Model
from palpate.mechanics.options import option
from palpate.mechanics.presses.table import Presses
from palpate.reconstruction.steps.s7_modulus.press_fit import LawFit, far_sensitivity, fit_law, press_data

LEAST_GAIN = 4.0
"""Log likelihood by which a field must be likelier than places that scatter at random ..."""
LEAST_EXPLAINED = 0.2
"""... and the share of the places' scatter that it must predict where they were left out."""
LEAST_FELT = 0.05
"""... and by how much the places' moduli must differ by it (standard deviation of ln E): less than that shape
and mesh bring about as well."""
LEAST_SITES = 5
"""A field is four numbers (level, spread, length, scatter beside it): fewer places than that and one more
tell no field. How many rows a place has does not matter: its modulus's own error does."""
REFITS = 1
LAW_ERROR = DepthLaw.field.value
LEVEL_BIAS = Level.field.value
"""Standard error of the level that no press tells: law and mesh, as of a global modulus."""


@dataclass(frozen=True)
class PressModuli:
    """Each press's own modulus and what it tells of. fit: by the law. answer: (p,) m. shares: of the field.
    data, sites, noise_n: what was fitted.

    usable: (p,) bool, presses whose fit says anything.
    """

    fit: LawFit
    answer: np.ndarray
    shares: Shares
    site: np.ndarray
    places: Places
    data: Presses
    sites: TouchSites
    noise_n: float

    @cached_property
    def views(self) -> Views:
        """What the presses see of a field's places: those of all presses, whichever a field is fitted to."""
        rows = np.flatnonzero(self.usable)
        touched = tips_of(self.places)[rows[np.unique(self.site[rows], return_index=True)[1]]]
        elements = self.shares.nodes[: self.shares.weight.shape[1] - len(self.site)]
        return views_of(self.shares, places_of(touched, elements), lengths_of(touched, elements))

    @property
    def usable(self) -> np.ndarray:
        return self.fit.telling

    def beside(self, field: SmoothField) -> LawFit:
        """Every press's modulus as if the object were of one, from a fit with a field where it is: solved in
        the elements, less what the field is to first order."""
        there = with_field(self.sites, self.places, field)
        radius, fit = self.data.tip_radius_m, self.fit
        found = fit_law(
            self.data, there.sites, radius, fit.law, fit.depth_m, LAW_ERROR, self.noise_n, start=fit
        )
        log_factor = self.shares.weight @ field.at(self.shares.nodes)
        return replace(found, modulus_pa=found.modulus_pa / there.ratio * np.exp(log_factor))


def press_moduli(
    presses: Presses, sites: TouchSites, places: Places, law: str, noise_n: float
) -> PressModuli:
    """Of presses that touch at `sites` and `places` (one a press, in order). noise_n: N, of a raw sample."""
    data, radius = press_data(presses), presses.tip_radius_m
    fit = fit_law(data, sites, radius, law, float(presses.depth_m.max()) + 1e-3, LAW_ERROR, noise_n)
    answer = far_sensitivity(data, sites, fit, radius, LAW_ERROR, noise_n)
    return PressModuli(fit, answer, shares_of(places, answer), presses.site, places, data, sites, noise_n)


def fit_field(own: PressModuli, seen: np.ndarray) -> FieldEstimate | None:
    """The likeliest field of the presses `seen` (numbers); None where too few places tell.

    Shares of the compliance are first order in the field: where it is asked for, the presses are fitted anew
    beside it.
    """
    found = _likeliest(own, own.fit, seen)
    for _ in range(REFITS):
        if found is None or not asked_for(found):
            break
        found = _likeliest(own, own.beside(found.field), seen)
    return found


def _likeliest(own: PressModuli, fit: LawFit, seen: np.ndarray) -> FieldEstimate | None:
    seen = seen[fit.telling[seen]]
    if len(np.unique(own.site[seen])) < LEAST_SITES:
        return None
    return estimate(
        np.log(fit.modulus_pa[seen]), fit.relative_error[seen], own.site[seen], own.views.of(seen)
    )


def asked_for(found: FieldEstimate | None) -> bool:
    """Whether the evidence asks for a field."""
    return (
        found is not None
        and found.gain > LEAST_GAIN
        and found.explained > LEAST_EXPLAINED
        and found.felt > LEAST_FELT
    )


@dataclass(frozen=True)
class FieldSites:
    """Touch sites of an object with a field. sites: their far fields over the modulus under each tip. ratio:
    (p,) of that modulus over the object's."""

    sites: TouchSites
    ratio: np.ndarray

    def unit_forces(self, presses: Presses, law: str, moved_m: np.ndarray | None = None) -> np.ndarray:
        """(n, 3) N, device frame, for unit modulus of the object. moved_m: (p,) by how much earlier each
        press meets the surface than it says."""
        displacement = presses.displacement
        if moved_m is not None:
            displacement = displacement - (moved_m[:, None] * presses.normal)[presses.press]
        force = forces_at(
            self.sites, displacement, presses.starts, young_modulus_pa=1.0,
            tip_radius_m=presses.tip_radius_m, law=law,
        )  # fmt: skip
        return force * self.ratio[presses.press][:, None]


def with_field(sites: TouchSites, places: Places, field: SmoothField | None) -> FieldSites:
    """The sites as they are with a field, solved with it in the elements or beside one that was
    (mechanics.compliance.field_response); None: of one modulus."""
    if field is None:
        return FieldSites(sites, np.ones(len(sites)))
    mesh = places.model.mesh
    log_ratio = field.at(mesh.points[mesh.tetrahedra[:, :4]].mean(axis=1))
    # of what is nearer than the load's width the modulus under the tip tells, not a sharper load
    solved, half, width = far_in_field(places, log_ratio)
    under = np.exp(field.at(tips_of(places)))
    # a dent of `under` times the modulus in a far field of 1 is that of one modulus in a stiffer far field
    scale = under[:, None, None]
    far = scale * solved[places.place] + (scale - 1) * half[places.place]
    far += scale * edge_law(mesh, sites.points, sites.normals).far
    return FieldSites(replace(sites, far=far, patch_width_m=width), under)


@dataclass(frozen=True)
class FieldOptions:
    """Whether an object may be of more than one modulus."""

    field: str = option(
        "homogeneous",
        "a smooth field of the modulus: never, where the presses show one, or where they do and a 1D "
        "model predicts them better than one modulus does",
        choices=("homogeneous", "auto", "where-beaten"),
    )


def modulus_by_field(own: PressModuli, found: FieldEstimate) -> np.ndarray:
    """(p,) Pa, each press's modulus, as if the object were of one, as the presses of other sites tell it."""
    log_modulus = found.level + own.shares.weight @ found.field.at(own.shares.nodes)
    number = np.clip(np.searchsorted(found.site, own.site), 0, len(found.site) - 1)
    log_modulus = np.where(found.site[number] == own.site, found.foretold[number], log_modulus)
    return np.exp(log_modulus)


def with_fitted_field(
    model: Model, presses: Presses, sites: TouchSites, noise_n: float
) -> tuple[Model, np.ndarray | None]:
    """The model with the field that presses, which touch at `sites`, ask for by its dent law, and what
    `modulus_by_field` says of them; itself and None where they ask for none. noise_n: N, of a raw component.

    The modulus becomes that of the field's own level, with its 95 % interval.
    """
    places = places_at(model, presses, sites)
    own = press_moduli(presses, sites, places, model.material.dent_law, noise_n)
    found = fit_field(own, np.arange(len(presses)))
    if found is None or not asked_for(found):
        return model, None
    modulus = float(np.exp(found.level))
    share = float(np.exp(1.96 * np.hypot(found.level_sd, sites.law_error(LEVEL_BIAS).mean())))
    levelled = model.with_material(
        young_modulus_pa=modulus, young_modulus_ci95_pa=(modulus / share, modulus * share)
    )
    there = stiffness_field.EFFECT.applied(levelled, stiffness_field.keys_of(found.field))
    return there, modulus_by_field(own, found)
