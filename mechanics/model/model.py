"""A reconstructed model: what a renderer needs, typed. Its folder: mechanics.model.files."""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np

from palpate.mechanics.errors import ModelError
from palpate.mechanics.model.material import (
    UNKNOWN,
    ObjectMaterial,
    finite,
    gradient_ratio,
    height_share,
    positive,
    skin_ratio,
    with_balls,
    within_limits,
)
from palpate.mechanics.plausible import USUAL_TIP_RADIUS_M
from palpate.mechanics.presses.making import no_presses
from palpate.mechanics.presses.table import Presses
from palpate.mechanics.result import Result
from palpate.mechanics.shape.tetmesh import TetMesh, vertex_normals


@dataclass(frozen=True, eq=False)
class Support:
    """The plane that an object stands on: point (3,) m; normal (3,), made a unit vector, into the object.

    Raises ModelError where one is not finite, or the normal has no direction.
    """

    point: np.ndarray
    normal: np.ndarray

    def __post_init__(self) -> None:
        point, normal = finite("support_point", self.point, (3,)), finite("support_normal", self.normal, (3,))
        length = np.linalg.norm(normal)
        if not length > 0:
            raise ModelError("support_normal is [0, 0, 0]; it must point out of the support")
        if abs(length - 1) > 1e-15:  # a unit vector keeps its bits
            normal = normal / length
        for name, value in (("point", point), ("normal", normal)):
            value.setflags(write=False)
            object.__setattr__(self, name, value)

    def height(self, points: np.ndarray) -> np.ndarray:
        """(k,) m over the plane, of points (k, 3)."""
        return (np.asarray(points) - self.point) @ self.normal


@dataclass(frozen=True)
class Tool:
    """tip_radius_m: of the rigid sphere that touches; greater than 0."""

    tip_radius_m: float

    def __post_init__(self) -> None:
        object.__setattr__(self, "tip_radius_m", positive("tip_radius_m", self.tip_radius_m))


@dataclass(frozen=True, eq=False, repr=False)
class Model(Result):
    """An object that can be felt, everything that a renderer needs; m, N, Pa, device frame.

    shape_uncertainty_m: (n,) standard deviation of the surface along its normal at each node, or None.
    presses: the table of what was pressed. effects: parameters of every effect that a diagnosis added, by
    name; what of one is material stands in the material, and only that counts. provenance: where it came
    from. about: tables that inform, by name;
    nothing reads physics from these two. `plot`: the object with the places touched. `show`: the same in 3D
    on its support, the touches coloured by their own modulus, kPa.
    """

    mesh: TetMesh
    material: ObjectMaterial
    support: Support
    tool: Tool
    mesh_size_m: float
    shape_uncertainty_m: np.ndarray | None = None
    presses: Presses = field(default_factory=lambda: no_presses(USUAL_TIP_RADIUS_M))
    effects: Mapping[str, Mapping[str, Any]] = field(default_factory=dict)
    provenance: Mapping[str, Any] = field(default_factory=dict)
    about: Mapping[str, Mapping[str, Any]] = field(default_factory=dict)
    path: Path | None = None

    def __post_init__(self) -> None:
        given, needed = self.material.field, len(self.mesh.tetrahedra)
        if given is not None and len(given) != needed:
            raise ModelError(f"field has {len(given)} values; the mesh needs {needed}, one a tetrahedron")

    @property
    def name(self) -> str:
        """Of the recording, phantom or folder that it came from."""
        known = self.provenance.get("recording") or self.provenance.get("phantom")
        return str(known or (self.path.name if self.path else "model"))

    @cached_property
    def normals(self) -> np.ndarray:
        """(n, 3) outward unit normals at the nodes of the touchable surface, zero elsewhere."""
        return vertex_normals(self.mesh.points, self.mesh.touchable_surface)

    @cached_property
    def element_ratio(self) -> np.ndarray:
        """(m,) modulus of each tetrahedron over the global one, of all parts of the material."""
        skin, bulk = self.material.skin, self._bulk_ratio
        within = self.surface_ratio if skin is None else within_limits(bulk * skin_ratio(self.mesh, skin))
        return with_balls(self.mesh, within, self.material.inclusions.values())

    @cached_property
    def solid_ratio(self) -> np.ndarray:
        """(m,) without the skin, which our solvers have as a membrane (mechanics.elastic.membrane)."""
        return with_balls(self.mesh, self.surface_ratio, self.material.inclusions.values())

    @property
    def stretch_m(self) -> float:
        """m, of that membrane."""
        return 0.0 if self.material.skin is None else self.material.skin.stretch_m

    @cached_property
    def surface_ratio(self) -> np.ndarray:
        """(m,) without the skin and without balls: what a dent meets beside its law, and what balls lie in
        where they are drawn by themselves."""
        return within_limits(self._bulk_ratio)

    @cached_property
    def _bulk_ratio(self) -> np.ndarray:
        material, ratio = self.material, np.ones(len(self.mesh.tetrahedra))
        if material.field is not None:
            ratio = ratio * material.field
        if material.gradient is not None:
            height = height_share(self.mesh, self.support.point, self.support.normal)
            ratio = ratio * gradient_ratio(material.gradient, height)
        return ratio

    @property
    def untouched(self) -> bool:
        """Whether nobody pressed the object: the presses were computed, as of a known shape."""
        return self.provenance.get("method") == "scene"

    def fitted_to(self, presses: Presses) -> bool:
        """Whether its surface was fitted to these presses, and moves along with where they first met it."""
        return self.presses.recording == presses.recording

    def replaced(self, **changes: Any) -> Model:
        """A copy with some fields changed."""
        return dataclasses.replace(self, **changes)

    def with_material(self, **changes: Any) -> Model:
        """A copy with some fields of the material changed. The path stays: caches are keyed by content."""
        return self.replaced(material=dataclasses.replace(self.material, **changes))

    def with_modulus(self, young_modulus_pa: float) -> Model:
        """A copy of another global modulus, whose interval nobody estimated."""
        return self.with_material(young_modulus_pa=young_modulus_pa, young_modulus_ci95_pa=UNKNOWN)
