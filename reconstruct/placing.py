"""The presses of a recording on the surface of a model, whether or not the model was made from it."""

from __future__ import annotations

from mechanics.errors import NoBaseError
from mechanics.model import Model
from mechanics.presses import Presses
from mechanics.recording import Recording
from reconstruct.casting import cast
from reconstruct.contacts import ContactOptions, explore
from reconstruct.known_base import base_of_model

_ANY = ContactOptions(least_palpations=1)


def presses_on(recording: Recording, model: Model) -> Presses:
    """The model's own table where it was made from this recording; else its presses, found and cast onto the
    model's surface. A recording that does not trace a base stands on the model's.

    Raises ContactError where the recording holds no press.
    """
    own = model.presses
    if own.sampled and own.recording == recording.content:
        return own
    try:
        found = explore(recording, contact_options=_ANY).presses
    except NoBaseError:
        base = base_of_model(model, recording.tip_radius_m)
        found = explore(recording, contact_options=_ANY, boundary=base).presses
    where = cast(model.mesh.points, model.mesh.touchable_surface, found.point, found.contact_normal)
    return found.on_surface(where.points, where.normals)
