"""The program's own truth about one press: a sphere on the felt surface of a body, solved."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from palpate.mechanics.errors import OptionError
from palpate.mechanics.press_solver.body import BodyMaterial, PressedBody
from palpate.mechanics.press_solver.contact import PressContact
from palpate.mechanics.press_solver.equilibrium import PressPath, Settling
from palpate.mechanics.press_solver.graded_mesh import CurvedSurface, drawn_to, graded_mesh
from palpate.mechanics.progress import Progress, silent
from palpate.mechanics.shape.refine import refined_at_feet
from palpate.mechanics.shape.tetmesh import TetMesh

_LONGEST = 1.3
"""Longest over typical edge of a tetrahedron."""

LAWS = ("linear", "neo-hookean")

_LOCAL_BULK = 5.0
"""Of a linear body (Solid): by their means alone, elements as wide as half a contact are 0.7 to 1.9 % softer
than closed forms and the axisymmetric table; with 8 they are 0.3 % softer to 1.4 % harder. At finite strain
there is none: by their means the table is met to 0.4 %, and with 5 they are 1.0 to 1.6 % too hard."""


@dataclass(frozen=True)
class PressOptions:
    """How a press is solved.

    law: 'linear', or 'neo-hookean' at finite strain; with it stiffening, r of
    mechanics.effects.strain_stiffening, and coupled, its energy (mechanics.press_solver.solid). friction:
    Coulomb's coefficient, 0 for none; None sticks. finest: edges at the place, radii of the first contact,
    sqrt(R depth); growth: edges over their distance from the way of the tip. zone: of finite strain, radii of
    the deepest contact; inf: the whole body. reach: of what may be touched, in the same. step: longest load
    step, tip radii. penalty: traction an overlap, of Young's modulus over the first contact's radius.
    tolerance: residual over the contact's forces. Raises OptionError for a law or friction that is not
    allowed.
    """

    law: str = "neo-hookean"
    stiffening: float = 0.0
    coupled: bool = False
    friction: float | None = None
    finest: float = 0.5
    growth: float = 0.8
    zone: float = 6.0
    reach: float = 1.1
    step: float = 0.2
    penalty: float = 1500.0
    tolerance: float = 2e-4

    def __post_init__(self) -> None:
        if self.law not in LAWS:
            raise OptionError(f"law is '{self.law}'; allowed are {', '.join(LAWS)}")
        if self.friction is not None and not self.friction >= 0:
            raise OptionError(f"friction is {self.friction:g}; it must be at least 0, or None to stick")


@dataclass(frozen=True)
class PressSolution:
    """Along the path. force: (k, 3) N, on the tool. contact_radius: (k,) m, of a circle of the contact's
    projected area. energy: (k,) J, stored in the body. converged: (k,) bool; nan from the first that is not.
    """

    force: np.ndarray
    contact_radius: np.ndarray
    energy: np.ndarray
    converged: np.ndarray


class PressSolver:
    """An object that is pressed: built once, asked place by place.

    mesh: tetrahedra of the object, with their fixed base. surface: the shape's file, (vertices, triangles),
    however coarse, or None where the mesh's own is felt. ratio: (m,) modulus of each tetrahedron over the
    global one, or None.
    """

    def __init__(
        self,
        mesh: TetMesh,
        surface: tuple[np.ndarray, np.ndarray] | None,
        *,
        young_modulus_pa: float,
        poisson_ratio: float,
        tip_radius_m: float,
        ratio: np.ndarray | None = None,
        options: PressOptions = PressOptions(),
    ) -> None:
        self._surface = None if surface is None else CurvedSurface(*surface)
        mesh, parent = refined_at_feet(mesh)
        self.mesh = drawn_to(mesh, self._surface)
        self.young_modulus_pa, self.poisson_ratio = float(young_modulus_pa), float(poisson_ratio)
        self.tip_radius_m, self.options = float(tip_radius_m), options
        self._ratio = np.ones(len(parent)) if ratio is None else np.asarray(ratio, dtype=float)[parent]

    def on_surface(self, point: np.ndarray) -> np.ndarray:
        """(3,) m, the felt place nearest to a point (3,) m."""
        point = np.asarray(point, dtype=float)
        return point if self._surface is None else self._surface.nearest(point)[0]

    def press(
        self,
        point: np.ndarray,
        normal: np.ndarray,
        depths: np.ndarray,
        slide: np.ndarray | None = None,
        progress: Progress = silent,
    ) -> PressSolution:
        """Press at `point` (3,) m against the outward normal (3,) to `depths` (k,) m, then move the tip.

        slide: (s, 3) m, where the tip goes from where it is deepest. The solution holds k + s places. Raises
        OptionError where depths are not positive and increasing.
        """
        point, depths = np.asarray(point, dtype=float), np.atleast_1d(np.asarray(depths, dtype=float))
        normal = np.asarray(normal, dtype=float) / np.linalg.norm(normal)
        if not (len(depths) and depths[0] > 0 and (np.diff(depths) > 0).all()):
            raise OptionError(f"depths are {depths.tolist()}; they must be positive and increasing, m")
        start = point + self.tip_radius_m * normal
        centres = start - depths[:, None] * normal
        if slide is not None:
            centres = np.vstack([centres, centres[-1] + np.asarray(slide, dtype=float)])
        path = self._prepared(point, normal, depths, centres[-1] - centres[0])
        count, scale = len(centres), self.young_modulus_pa
        force, radius, energy = np.full((count, 3), np.nan), np.full(count, np.nan), np.full(count, np.nan)
        for k, centre in enumerate(centres):
            progress(
                f"solving {1e3 * depths[min(k, len(depths) - 1)]:.2g} of {1e3 * depths[-1]:.2g} mm", k / count
            )
            if not self._driven(path, start, centre):
                break
            force[k], energy[k] = scale * path.state.force, scale * path.state.energy
            radius[k] = path.contact_radius(normal)
        return PressSolution(force, radius, energy, np.isfinite(energy))

    def _driven(self, path: PressPath, start: np.ndarray, centre: np.ndarray) -> bool:
        """Drive the sphere straight to `centre` in steps that grow with what it has travelled; whether it got
        there. Where a point meets the sphere is found to first order in the step."""
        least, most = 0.3 * self.options.step * self.tip_radius_m, self.options.step * self.tip_radius_m
        while (left := float(np.linalg.norm(centre - path.state.centre))) > 1e-12:
            gone = float(np.linalg.norm(path.state.centre - start))
            step = min(max(0.4 * gone, least), most)
            share = 1 / np.ceil(left / step - 1e-6)
            if not path.advance(path.state.centre + share * (centre - path.state.centre)):
                return False
        return True

    def _prepared(
        self, point: np.ndarray, normal: np.ndarray, depths: np.ndarray, way: np.ndarray
    ) -> PressPath:
        """The body around a place, and the sphere that just touches it. way: (3,) m, of the tip."""
        options, tip = self.options, self.tip_radius_m
        first, last = (float(np.sqrt(tip * min(d, tip))) for d in (depths[0], depths[-1]))
        last = max(last, 0.3 * tip)
        across = way - (way @ normal) * normal

        def far(at: np.ndarray) -> np.ndarray:
            """Distance from the way of the tip along the surface."""
            along = np.clip((at - point) @ across / max(across @ across, 1e-300), 0.0, 1.0)
            return np.linalg.norm(at - point - along[:, None] * across, axis=1)

        def size(at: np.ndarray) -> np.ndarray:
            return _LONGEST * np.maximum(options.finest * first, options.growth * far(at))

        mesh = graded_mesh(self.mesh, self._surface, size)
        corner = mesh.points[mesh.faces[:, :3]]
        across_faces = np.cross(corner[:, 1] - corner[:, 0], corner[:, 2] - corner[:, 0])
        reach = far(corner.mean(axis=1)) < options.reach * last + 0.1 * tip
        faces = mesh.faces[reach & (across_faces @ normal > 0)]
        if not len(faces):
            raise OptionError(f"no element's face lies within the contact: finest is {options.finest:g}")
        near = np.zeros(len(mesh.cells), dtype=bool)
        if options.law != "linear":
            near = far(mesh.points[mesh.cells[:, :4]].mean(axis=1)) < options.zone * last
            near |= np.isin(mesh.cells, faces).any(axis=1)
        nodes = np.unique(faces)
        local = _LOCAL_BULK if options.law == "linear" else 0.0
        material = BodyMaterial(
            self.poisson_ratio, options.stiffening, options.coupled, self._ratio[mesh.parent], local
        )
        body = PressedBody(mesh, material, near, nodes)
        contact = PressContact(
            mesh.points[nodes], np.searchsorted(nodes, faces), tip, options.friction, options.penalty / first
        )
        rank = np.full(body.size + 1, -1)
        rank[body.kept] = np.arange(len(body.kept))
        settling = Settling(contact, rank[body.number.reshape(-1, 3)[nodes]])
        return PressPath(body, settling, point + tip * normal, options.tolerance)
