"""A model meets a recording that it was not made from: its presses are found and cast onto its surface."""

from __future__ import annotations

import dataclasses

from mechanics.model import Model
from mechanics.palpation import Palpation
from mechanics.recording import Recording
from reconstruct.casting import cast
from reconstruct.contacts import explore
from reconstruct.known_base import base_of_model


def placed(recording: Recording, model: Model) -> Model:
    """The model with the palpations of this recording; itself where it was made from it.

    Raises ContactError where the recording holds too few presses.
    """
    if model.palpations and model.provenance.get("recording_sha256") == recording.sha256:
        return model
    base = None if recording.boundary_phase else base_of_model(model, recording.tip_radius_m)
    exploration = explore(recording, boundary=base)
    on = cast(model.mesh.points, model.mesh.touchable_surface, exploration.points, exploration.normals)
    rows = [
        Palpation(
            float(recording.t[c.start]), float(c.t_peak), *map(float, p), *map(float, n), depth=c.depth_m
        )
        for c, p, n in zip(exploration.contacts, on.points, on.normals, strict=True)
    ]
    return dataclasses.replace(model, palpations=tuple(rows))
