"""The program's own truth about one press: a sphere on the felt surface of a body, solved."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from mechanics.press_solver.body import Body
from mechanics.press_solver.contact import SphereContact
from mechanics.press_solver.equilibrium import Path
from mechanics.press_solver.felt_surface import FeltSurface
from mechanics.press_solver.graded_mesh import GradedMesh, drawn_to, graded_mesh
from mechanics.press_solver.settling import Settling
from mechanics.tetmesh import TetMesh


@dataclass(frozen=True)
class PressOptions:
    """How a press is solved.

    law: 'neo-hookean' (with `stiffening` of mechanics.effects.strain_stiffening) at finite strain, or
    'linear'. friction: Coulomb's coefficient; None sticks. finest: edges under the first contact, contact
    radii; growth: edges a distance from the place. zone: of finite strain, radii of the deepest contact;
    inf solves the whole body so. step: longest load step, tip radii. penalty: traction an overlap, of E over
    the first contact's radius.
    """

    law: str = "neo-hookean"
    stiffening: float = 0.0
    coupled: bool = False
    friction: float | None = None
    finest: float = 0.5
    growth: float = 0.8
    zone: float = 3.5
    reach: float = 1.1
    step: float = 0.2
    penalty: float = 1500.0
    tolerance: float = 2e-4


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

    mesh: tetrahedra of the object, with their fixed base. surface: the felt one, (vertices, triangles), or
    None where the mesh's own is. ratio: (m,) modulus of each tetrahedron over the global one, or None.
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
        self._surface = None if surface is None else FeltSurface(*surface)
        self.mesh = drawn_to(mesh, self._surface)
        self.young_modulus_pa, self.poisson_ratio = float(young_modulus_pa), float(poisson_ratio)
        self.tip_radius_m, self.options = float(tip_radius_m), options
        self._ratio = np.ones(len(mesh.tetrahedra)) if ratio is None else np.asarray(ratio, dtype=float)

    def press(
        self, point: np.ndarray, normal: np.ndarray, depths: np.ndarray, slide: np.ndarray | None = None
    ) -> PressSolution:
        """Press at `point` (3,) m against the outward normal (3,) to `depths` (k,) m, increasing; then move the
        tip by each of `slide` (s, 3) m from where it is deepest. Results hold k + s places of the path."""
        point = np.asarray(point, dtype=float)
        normal = np.asarray(normal, dtype=float) / np.linalg.norm(normal)
        depths = np.asarray(depths, dtype=float)
        start = point + self.tip_radius_m * normal
        centres = start - depths[:, None] * normal
        if slide is not None:
            centres = np.vstack([centres, centres[-1] + np.asarray(slide, dtype=float)])
        path, settling = self._prepared(point, normal, depths, centres, start)
        self.last = path
        count, scale = len(centres), self.young_modulus_pa
        force, radius, energy = np.full((count, 3), np.nan), np.full(count, np.nan), np.full(count, np.nan)
        for k, centre in enumerate(centres):
            if not self._driven(path, start, centre):
                break
            state = path.state
            force[k], energy[k] = scale * state.force, scale * state.energy
            radius[k] = self._contact_radius(settling, path, normal)
        return PressSolution(force, radius, energy, np.isfinite(energy))

    def _driven(self, path: Path, start: np.ndarray, centre: np.ndarray) -> bool:
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
        self, point: np.ndarray, normal: np.ndarray, depths: np.ndarray, centres: np.ndarray, start: np.ndarray
    ) -> tuple[Path, Settling]:
        options, tip = self.options, self.tip_radius_m
        first, last = (np.sqrt(tip * min(d, tip)) for d in (depths[0], depths[-1]))
        across = centres[-1] - start
        across = across - (across @ normal) * normal

        def far(at: np.ndarray) -> np.ndarray:
            """Distance from the way of the tip along the surface."""
            way = at - point
            along = np.clip(way @ across / max(across @ across, 1e-300), 0.0, 1.0)
            return np.linalg.norm(way - along[:, None] * across, axis=1)

        def size(at: np.ndarray) -> np.ndarray:
            return 1.3 * np.maximum(options.finest * first, options.growth * far(at))

        mesh = graded_mesh(self.mesh, self._surface, size)
        middle = mesh.points[mesh.cells[:, :4]].mean(axis=1)
        deepest = max(float(last), 0.3 * tip)
        near = far(middle) < options.zone * deepest
        if options.law == "linear":
            near[:] = False
        reach = far(mesh.points[mesh.faces[:, :3]].mean(axis=1)) < options.reach * deepest + 0.1 * tip
        facing = np.einsum("fi,i->f", _across(mesh), normal) > 0.0
        faces = mesh.faces[reach & facing]
        if near.any():
            near |= np.isin(mesh.cells, faces).any(axis=1)
        nodes = np.unique(faces)
        body = Body(mesh, self.poisson_ratio, options.stiffening, self._ratio[mesh.parent], near, nodes, options.coupled)
        local = np.full(len(mesh.points), -1)
        local[nodes] = np.arange(len(nodes))
        contact = SphereContact(
            mesh.points[nodes], local[faces], tip, options.friction, options.penalty / first
        )
        number = body.number.reshape(-1, 3)[nodes]
        rank = np.full(body.size + 1, -1)
        rank[body.kept] = np.arange(len(body.kept))
        settling = Settling(contact, rank[number])
        return Path(body, settling, start, options.tolerance), settling

    @staticmethod
    def _contact_radius(settling: Settling, path: Path, normal: np.ndarray) -> float:
        contact = settling.contact
        points = contact.points + settling.displaced(path.state.displacement[path.body.kept])
        area = (contact.area_vectors(points) @ normal).ravel()[path.state.pressing].sum()
        return float(np.sqrt(max(area, 0.0) / np.pi))


def _across(mesh: GradedMesh) -> np.ndarray:
    p = mesh.points[mesh.faces[:, :3]]
    return np.cross(p[:, 1] - p[:, 0], p[:, 2] - p[:, 0])
