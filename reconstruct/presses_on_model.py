"""The presses of a recording on the surface of a model, whether or not the model was made from it."""

from __future__ import annotations

import numpy as np

from palpate.mechanics.errors import ContactError
from palpate.mechanics.model.model import Model
from palpate.mechanics.presses.table import Presses
from palpate.mechanics.recording.recording import Recording
from palpate.reconstruction.geometry.stated import GeometryOptions, base_of_model, stated_geometry
from palpate.reconstruction.steps.s1_filter.signals import stated_tracing
from palpate.reconstruction.steps.s2_base import Boundary
from palpate.reconstruction.steps.s3_contacts.contacts import ContactOptions, explore
from palpate.reconstruction.steps.s3_contacts.left_out import off_surface, without_slides
from palpate.reconstruction.steps.s3_contacts.quasi_static import explore_points, is_points
from palpate.reconstruction.steps.s3_contacts.sliding_presses import laid
from palpate.reconstruction.steps.s4_surface import cast

_ANY = ContactOptions(least_palpations=1)
_FAR = 3.0
"""Tip radii that a path stays off the model's box at least, before it is called far."""


def presses_on(recording: Recording, model: Model) -> Presses:
    """The model's own table where it was made from this recording; else its presses, found and cast onto the
    model's surface. A recording that does not trace a base, or states what it lies on, stands on the model's.
    Presses that are not on that surface (`left_out.off_surface`) are left out.

    Raises ContactError where the recording holds no press on the model, or lies far from it.
    """
    check_near(recording, model)
    own = model.presses
    if own.sampled and own.recording == recording.content:
        return own
    base, stated = base_of_model(model, recording.tip_radius_m), stated_geometry(recording, GeometryOptions())
    found = _found(recording, model, base, stated.known)
    where = cast(model.mesh.points, model.mesh.touchable_surface, found.point, found.contact_normal)
    reasons = off_surface(found, where.points, where.normals, base)
    kept = np.array([not reason for reason in reasons])
    if not kept.any():
        raise ContactError(f"none of the {len(kept)} presses is on the model: the first {reasons[0]}")
    # the model says what it was placed as, else the recording states it
    kind = str(model.about.get("geometry", {}).get("kind") or stated.kind)
    return laid(found.of(kept), where.points[kept], where.normals[kept], kind)


def check_near(recording: Recording, model: Model) -> None:
    """Raises ContactError for a path that nowhere comes near the model: it is of another frame."""
    points = model.mesh.points
    beyond = np.maximum(points.min(axis=0) - recording.position, recording.position - points.max(axis=0))
    away = float(np.linalg.norm(np.maximum(beyond, 0.0), axis=1).min(initial=np.inf))
    if away > _FAR * recording.tip_radius_m:
        raise ContactError(
            f"'{recording.name}' lies {away:.2g} m from the model at the nearest: is it in another frame, or "
            "of another object? give the model that was made from it"
        )


def _found(recording: Recording, model: Model, base: Boundary, known: bool) -> Presses:
    """The presses as such, over the base that was traced, else over the model's. known: the recording states
    its geometry."""
    if is_points(recording):
        return explore_points(recording, base, _ANY).presses
    if not known:
        try:
            found = explore(recording, contact_options=_ANY)
        except ContactError:
            if stated_tracing(recording) is not None:
                raise  # else slides of the object may have passed for a tracing that never was
        else:
            if stated_tracing(recording) is not None or _traces(found.boundary, model):
                return found.presses
    found = explore(recording, contact_options=_ANY, boundary=base, unbroken=True)
    return without_slides(found, _ANY.least_palpations).presses


def _traces(boundary: Boundary, model: Model) -> bool:
    """Whether what was taken for a tracing of the base lies on the plane that the model stands on: slides of
    the object, which a recording without phase I begins with, lie elsewhere."""
    off = (boundary.outline - model.support.point) @ model.support.normal
    return float(np.median(np.abs(off))) < model.tool.tip_radius_m
