"""A known geometry where it lies, and the rim of its base.

A base that was not traced: that of an earlier model ([object] model = PATH), or of a known shape.

Which geometry is known: by options, or by what the recording says of its object.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np

from palpate.mechanics.disk.surface_files import UNITS
from palpate.mechanics.errors import ContactError, NoBaseError, OptionError
from palpate.mechanics.frames import support_axes, tangents
from palpate.mechanics.model.files import read_model
from palpate.mechanics.model.model import Model
from palpate.mechanics.options import option
from palpate.mechanics.recording.recording import GEOMETRY, Recording, base_model_of, stated_object
from palpate.mechanics.shape.tetmesh import TetMesh
from palpate.reconstruction.measured import Measured
from palpate.reconstruction.steps.s2_base import Boundary
from palpate.reconstruction.steps.s4_surface import Surface
from palpate.reconstruction.steps.s7_modulus.shape_error import PoseError


@dataclass(frozen=True)
class Placed:
    """A known geometry in the device frame.

    surface: closed, its uncertainty that of pose and file together. local_sd_m: of the file alone. pose: its
    error, None where it is taken as given. mesh: of a slab, which needs no mesher; None for a shape. base:
    as a tracing would give it. residual_m: (k,) of the first touches. about: what model.toml keeps,
    [geometry]. notes: what the user should know, one line each. doubt: why it may be another object's, or
    the tip another one, '' where the touches lie on it. likelier_radius_m: of that tip, or None. open_radii:
    factors on the stated radius that the touches, the pose being fitted, do not rule out.
    """

    surface: Surface
    local_sd_m: float
    pose: PoseError | None
    mesh: TetMesh | None
    base: Boundary
    residual_m: np.ndarray
    about: dict[str, Any]
    notes: tuple[str, ...]
    doubt: str = ""
    likelier_radius_m: float | None = None
    open_radii: tuple[float, ...] = ()

    @property
    def by_itself(self) -> Surface:
        """The surface with the file's uncertainty alone: the pose moves all of it together."""
        local = np.full(len(self.surface.vertices), self.local_sd_m)
        return dataclasses.replace(self.surface, uncertainty_m=local)


def nowhere(recording: Recording) -> Boundary:
    """A support so far below that nothing touches it, for a first look at the touches."""
    up = np.array([0.0, 0.0, 1.0])
    corners = np.array([[1, 1, 0], [-1, 1, 0], [-1, -1, 0], [1, -1, 0]], dtype=float)
    rim = np.vstack([corners, 0.5 * corners]) + recording.position.mean(axis=0) - 1e3 * up
    return base_of_rim(rim, rim[0], up, recording.tip_radius_m)


def foot_rim(vertices: np.ndarray, triangles: np.ndarray, foot: np.ndarray, up: np.ndarray) -> np.ndarray:
    """(k, 3) nodes of the foot that belong to a wall as well, in order round their middle."""
    low = np.abs((vertices - foot) @ up) < 1e-7
    down = low[triangles].all(axis=1)
    nodes = np.intersect1d(np.unique(triangles[down]), np.unique(triangles[~down]))
    axes = support_axes(up)
    offset = vertices[nodes] - vertices[nodes].mean(axis=0)
    return vertices[nodes][np.argsort(np.arctan2(offset @ axes[1], offset @ axes[0]))]


def base_of_model(model: Model, tip_radius_m: float) -> Boundary:
    """Support plane and base rim of a model whose fixed nodes lie on the support.

    Raises ContactError where the base has too few nodes.
    """
    rim = _ordered_rim(model)
    if len(rim) < 8:
        raise ContactError(
            f"the base of the model '{model.path}' has only {len(rim)} rim nodes; at least 8 are needed: "
            "reconstruct that model with a finer --mesh-size"
        )
    return base_of_rim(rim, model.support.point, model.support.normal, tip_radius_m)


def over_its_base(recording: Recording, found: Callable[[Boundary | None], Measured]) -> Measured:
    """What is found over the base that was traced (None); where none was, over that of [object] model = PATH.

    Raises NoBaseError where no model is stated either.
    """
    try:
        return found(None)
    except NoBaseError:
        if recording.base_model is None:
            raise
    return found(base_of_model(read_model(base_model_of(recording)), recording.tip_radius_m))


def base_of_rim(rim: np.ndarray, point: np.ndarray, normal: np.ndarray, tip_radius_m: float) -> Boundary:
    """What a tracing of a rim (k, 3), in order, would give; on the plane (point, normal), m."""
    after, before = np.roll(rim, -1, axis=0), np.roll(rim, 1, axis=0)
    outward = np.cross(after - before, normal)
    outward /= np.maximum(np.linalg.norm(outward, axis=1, keepdims=True), 1e-300)
    outward *= np.sign(np.sum(outward * (rim - rim.mean(axis=0))))
    return Boundary(
        support_point=point,
        support_normal=normal,
        outline=rim,
        centres=rim + tip_radius_m * (outward + normal),
        points=rim,
        interval=(0, 0),
        flatness_m=0.0,
    )


def _ordered_rim(model: Model) -> np.ndarray:
    """Fixed nodes that belong to a touchable triangle as well, in order round their middle."""
    mesh = model.mesh
    corners = np.unique(mesh.touchable_surface[:, :3])
    rim = mesh.points[corners[mesh.fixed[corners]]]
    if not len(rim):
        return rim
    u, v = tangents(model.support.normal)
    offset = rim - rim.mean(axis=0)
    return rim[np.argsort(np.arctan2(offset @ v, offset @ u))]


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
        0.0,
        "height that is cut off flat at the shape's bottom, where the object settles",
        unit="m",
        flag="--sink",
    )
    slab_m: float | None = option(
        None, "the object is a slab of this thickness; None: no slab", unit="m", flag="--slab"
    )
    half_space: bool = option(False, "the object is deep and wide compared with every contact")

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


_STATED = {key: "shape" if key == "shape" else key.removeprefix("shape_") for key in GEOMETRY}
"""Keys of a recording's [object], and the options that they stand for."""


def as_stated(options: GeometryOptions) -> dict[str, Any]:
    """The options that say something, as a recording's [object] says it."""
    usual = GeometryOptions()
    said = {key: getattr(options, name) for key, name in _STATED.items()}
    return {key: value for key, value in said.items() if value != getattr(usual, _STATED[key])}


def stated_geometry(recording: Recording, options: GeometryOptions) -> GeometryOptions:
    """The options, or what the recording's [object] says where they give no geometry."""
    if options.known:
        return options
    stated = {_STATED[key]: value for key, value in stated_object(recording).items()}
    try:
        return dataclasses.replace(options, **stated)
    except TypeError as error:
        raise OptionError(
            f"[object] of '{recording.name}' holds a value of the wrong kind: {error}"
        ) from error
