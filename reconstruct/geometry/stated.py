"""Which geometry is known: by options, or by what the recording says of its object."""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from palpate.mechanics.disk.surface_files import UNITS
from palpate.mechanics.errors import OptionError
from palpate.mechanics.options import option
from palpate.mechanics.recording.recording import Recording

POSES = ("auto", "given")


@dataclass(frozen=True)
class GeometryOptions:
    """The object's geometry where it is known: then no tracing is needed."""

    shape: str = option("", "file of the object's shape: STL, OBJ, PLY, glTF, VTP, VTU, MSH, INP")
    unit: str = option("m", "unit of length in the shape's file", choices=tuple(UNITS))
    pose: str = option(
        "auto",
        "where the shape lies: auto registers it to the first touches, given takes the device frame as it "
        "stands (a slab's top is then z = 0)",
        choices=POSES,
    )
    up: str = option("+z", "direction out of the support, in the shape's frame: +z, -x, ... or X,Y,Z")
    sink_m: float = option(
        0.0, "cut off flat at the shape's bottom, where the object settles", unit="m", flag="--sink"
    )
    slab_m: float | None = option(
        None, "the object is a slab of this thickness; None: it is none", unit="m", flag="--slab"
    )
    half_space: bool = option(False, "the object is deep and wide beside every contact")

    def __post_init__(self) -> None:
        """Raises OptionError for two geometries at once, or a thickness that is not positive."""
        given = [bool(self.shape), self.slab_m is not None, self.half_space]
        if sum(given) > 1:
            raise OptionError("--shape, --slab and --half-space exclude one another: give one")
        if self.slab_m is not None and not 0 < self.slab_m <= 2:
            raise OptionError(f"--slab is {self.slab_m} m; it must lie between 0 and 2 m")

    @property
    def known(self) -> bool:
        """Whether a geometry was given."""
        return bool(self.kind)

    @property
    def kind(self) -> str:
        """'shape', 'slab', 'half-space', or '' where it is not known."""
        flat = "slab" if self.slab_m is not None else "half-space" if self.half_space else ""
        return "shape" if self.shape else flat


_STATED = {
    "shape": "shape",
    "shape_unit": "unit",
    "shape_pose": "pose",
    "shape_up": "up",
    "shape_sink_m": "sink_m",
    "slab_m": "slab_m",
    "half_space": "half_space",
}
"""Keys of a recording's [object], and the options that they stand for."""


def stated_geometry(recording: Recording, options: GeometryOptions) -> GeometryOptions:
    """The options, or what the recording's [object] says where they give no geometry."""
    thing = recording.description.get("object", {})
    if options.known or not isinstance(thing, Mapping):
        return options
    keys: dict[str, Any] = {option: thing[key] for key, option in _STATED.items() if key in thing}
    if "shape" in keys and recording.path is not None:
        keys["shape"] = str(recording.path.parent / str(keys["shape"]))
    try:
        return dataclasses.replace(options, **keys)
    except TypeError as error:
        raise OptionError(
            f"[object] of '{recording.name}' holds a value of the wrong kind: {error}"
        ) from error
