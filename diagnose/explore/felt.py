"""What was felt so far: presses over the base that was traced, that of a stated model, or that of a stated
geometry where the presses place it."""

from __future__ import annotations

from palpate.mechanics.recording.recording import Recording
from palpate.reconstruction.geometry.known_shape import place
from palpate.reconstruction.geometry.stated import (
    GeometryOptions,
    Placed,
    nowhere,
    over_its_base,
    stated_geometry,
)
from palpate.reconstruction.measured import Measured
from palpate.reconstruction.steps.s3_contacts.contacts import ContactOptions, explore
from palpate.reconstruction.steps.s3_contacts.first_touch import ContactSpans
from palpate.reconstruction.steps.s3_contacts.left_out import on_base, within_slab, without_slides

MESH_M, SURFACE_SPACING_M = 0.016, 0.004
"""Tetrahedra of the running estimate, and how densely its surface is sampled."""


def felt(
    recording: Recording, least: int, spans: ContactSpans | None = None
) -> tuple[Measured, Placed | None]:
    """(presses over their base, the geometry that the recording's [object] states, placed by them or None).

    least: presses. Raises ContactError where fewer are found, NoBaseError where no base is traced and
    nothing stands in for it, SurfaceError where they do not lie on what is stated.
    """
    options, geometry = ContactOptions(least_palpations=least), stated_geometry(recording, GeometryOptions())
    if not geometry.known:
        return over_its_base(
            recording, lambda base: explore(recording, contact_options=options, boundary=base, spans=spans)
        ), None
    touches = explore(
        recording, contact_options=options, boundary=nowhere(recording), spans=spans, unbroken=True
    )
    touches = within_slab(without_slides(touches, least), geometry.slab_m)
    placed = place(touches, geometry, mesh_size_m=MESH_M, spacing_m=SURFACE_SPACING_M)
    return on_base(touches, placed.base, least), placed
