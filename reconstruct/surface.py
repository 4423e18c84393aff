"""The surface of a touched object: candidates from `reconstruct.shapes`, one chosen with its reason."""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np

from mechanics.errors import SurfaceError
from mechanics.options import option
from mechanics.progress import Progress, silent
from reconstruct.shapes.evidence import Evidence
from reconstruct.shapes.hull import hull_surface

if TYPE_CHECKING:
    import trimesh

    from reconstruct.contacts import Exploration

SURFACES = ("auto", "hull")


@dataclass(frozen=True)
class SurfaceOptions:
    """Which surface."""

    surface: str = option(
        "auto", "shape of the object; auto weighs all by held-out touches", choices=SURFACES
    )


@dataclass(frozen=True)
class Surface:
    """A closed surface standing on the support; device frame, m.

    vertices: (n, 3). triangles: (m, 3), outward by the right-hand rule, base included.
    uncertainty_m: (n,) standard deviation of the surface along its normal at each vertex.
    support_point, support_normal: (3,). method: the shape's name; reason: why it was chosen, in words.
    parameters: what the shape's fit found (lengths m). candidates: held-out error (m) of every shape that was tried.
    """

    vertices: np.ndarray
    triangles: np.ndarray
    uncertainty_m: np.ndarray
    support_point: np.ndarray
    support_normal: np.ndarray
    method: str
    reason: str
    parameters: dict[str, float] = field(default_factory=dict)
    candidates: dict[str, float] = field(default_factory=dict)

    def __post_init__(self) -> None:
        if not self.mesh.is_watertight:
            raise SurfaceError(
                f"the {self.method} surface is open: touch more places or choose another --surface"
            )
        if not self.mesh.volume > 0:
            raise SurfaceError(f"the {self.method} surface holds no volume: touch more places")

    @cached_property
    def mesh(self) -> trimesh.Trimesh:
        """The surface for trimesh (proximity, sampling), vertices in order."""
        import trimesh

        return trimesh.Trimesh(self.vertices, self.triangles, process=False)

    @property
    def volume_m3(self) -> float:
        """Enclosed volume."""
        return float(self.mesh.volume)


def evidence_of(exploration: Exploration) -> Evidence:
    """What an exploration says about the shape. Raises SurfaceError where it has no base outline."""
    boundary = exploration.boundary
    if boundary is None:
        raise SurfaceError(
            "the recording has no base outline: trace the base or give a model whose base stands in"
        )
    return Evidence(
        support_point=boundary.support_point,
        support_normal=boundary.support_normal,
        outline=boundary.outline,
        outline_centres=boundary.centres,
        centres=np.array([c.centre for c in exploration.contacts]),
        normals=exploration.normals,
        centre_error_m=np.array([c.onset_error_m for c in exploration.contacts]),
        tip_radius_m=exploration.recording.tip_radius_m,
    )


def reconstruct_surface(
    evidence: Evidence, options: SurfaceOptions | None = None, progress: Progress = silent
) -> Surface:
    """The surface that the touches and the base outline speak for.

    Raises SurfaceError where no closed surface can be made.
    """
    options = options or SurfaceOptions()
    progress("surface", 0.0)
    vertices, triangles = hull_surface(evidence)
    progress("surface", 1.0)
    return Surface(
        vertices=evidence.to_device(vertices),
        triangles=triangles,
        uncertainty_m=np.full(len(vertices), 0.002),
        support_point=evidence.origin,
        support_normal=evidence.axes[2],
        method="hull",
        reason="asked for" if options.surface == "hull" else "the only candidate",
    )
