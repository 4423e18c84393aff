"""What a person would use instead, each as short as it can be written: a mesh in, forces of straight presses
out.

Each class is the whole set-up that its user writes; `lines_of` counts it. A mesh is linear tetrahedra,
metres.
"""

from __future__ import annotations

import ast
import inspect
import textwrap
import time
from abc import ABC, abstractmethod

import numpy as np

from palpate.mechanics.elastic.solver import Solver
from palpate.mechanics.model.material import ObjectMaterial
from palpate.mechanics.model.model import Model, Support, Tool
from palpate.mechanics.shape.tetmesh import TetMesh
from palpate.reconstruction.steps.s7_modulus.modulus_paper import nearest_nodes
from palpate.render.options import RenderOptions
from palpate.render.simulators.mujoco import POISSON_LIMIT as FLEX_POISSON
from palpate.render.simulators.mujoco import MujocoSettings, scene_xml

NEAR_M = 0.009
"""Around a place: where a tip may touch, for a solver that is told of nodes."""
SETTLE_S, TIMESTEP_S = 0.1, 0.001
NEWTON_TIMESTEP_S, NEWTON_STEPS = 0.005, 40
"""Steps at each depth, half of them moving; three times as many change the force by 1 %."""
NEWTON_NUMBERS = f"timestep_s={NEWTON_TIMESTEP_S},sweeps=20,contact_n_per_m=1e5"
"""One contact against some 500 N/m of the node below."""

TIP_RADIUS_M = 0.005
YOUNG_PA, POISSON = 30e3, 0.49
DEPTHS_M = (0.001, 0.002, 0.003)


def hertz_n(depth_m: float) -> float:
    """Hertz' force of the tip in a half space, N."""
    return 4.0 / 3.0 * YOUNG_PA / (1 - POISSON**2) * np.sqrt(TIP_RADIUS_M) * depth_m**1.5


class Peer(ABC):
    """An object of one modulus (Pa), its base fixed, and a rigid ball (radius m) to press it with.

    steps, step_s: how many forces were computed, and the CPU time that they took together.
    """

    name: str
    made_for: str
    steps: int = 0
    step_s: float = 0.0

    @abstractmethod
    def __init__(self, mesh: TetMesh, young_pa: float, poisson: float, radius_m: float) -> None: ...

    @abstractmethod
    def force(self, point: np.ndarray, normal: np.ndarray, depths_m: np.ndarray) -> np.ndarray:
        """(k,) N along the outward normal (3,) at the surface's point (3,) m, at growing depths (k,) m."""


class Palpate(Peer):
    """This program's renderer, on quadratic tetrahedra."""

    name, made_for = "palpate", "one touched object, felt at 1 kHz by a rigid ball"

    def __init__(self, mesh: TetMesh, young_pa: float, poisson: float, radius_m: float) -> None:
        from palpate import render

        low = mesh.points[mesh.fixed].mean(axis=0)
        self.model = Model(
            mesh.quadratic(), ObjectMaterial(young_pa, poisson), Support(low, np.array([0.0, 0.0, 1.0])),
            Tool(radius_m), mesh_size_m=float(np.cbrt(8.5 * mesh.volumes.mean())),
        )  # fmt: skip
        self.renderer = render.create("fem", self.model)
        self.renderer.step(self.renderer.start(), np.full((1, 3), 1.0))

    def force(self, point: np.ndarray, normal: np.ndarray, depths_m: np.ndarray) -> np.ndarray:
        """Stepped in, as a servo does."""
        state, radius, forces, last = self.renderer.start(), self.model.tool.tip_radius_m, [], -1e-3
        for depth in depths_m:
            path = point + (radius - np.linspace(last, depth, 20)[1:])[:, None] * normal
            began, last = time.process_time(), depth
            for tip in path:
                state, force = self.renderer.step(state, tip[None])
            self.step_s += time.process_time() - began
            self.steps += len(path)
            forces.append(float(force[0] @ normal))
        return np.array(forces)


class PointLoad(Peer):
    """The paper's method: the whole force on the node nearest to the contact, linear tetrahedra."""

    name, made_for = "the paper's method", "a modulus from a coarse mesh of fixed size"

    def __init__(self, mesh: TetMesh, young_pa: float, poisson: float, radius_m: float) -> None:
        self.mesh, self.young_pa, self.solver = mesh, young_pa, Solver(mesh, poisson)

    def force(self, point: np.ndarray, normal: np.ndarray, depths_m: np.ndarray) -> np.ndarray:
        """Linear in depth."""
        node = int(nearest_nodes(self.mesh, point[None])[0])
        load = np.zeros((len(self.mesh.points), 3))
        load[node] = normal
        compliance = float(self.solver.solve(load)[node] @ normal)
        began = time.process_time()
        forces = self.young_pa * depths_m / compliance
        self.step_s, self.steps = self.step_s + time.process_time() - began, self.steps + len(depths_m)
        return forces


class ByHand(Peer):
    """A script with scikit-fem: quadratic tetrahedra, nodes near the tip, and an active set without
    friction."""

    name, made_for = "scikit-fem by hand", "any weak form that one can write down"

    def __init__(self, mesh: TetMesh, young_pa: float, poisson: float, radius_m: float) -> None:
        import skfem
        from scipy.sparse.linalg import splu
        from skfem.models.elasticity import lame_parameters, linear_elasticity

        quadratic = skfem.MeshTet2.from_mesh(skfem.MeshTet(mesh.points.T, mesh.tetrahedra.T))
        basis = skfem.Basis(quadratic, skfem.ElementVector(skfem.ElementTetP2()))
        stiffness = linear_elasticity(*lame_parameters(young_pa, poisson)).assemble(basis).tocsc()
        where = basis.doflocs
        floor = mesh.points[mesh.fixed][:, 2].max() + 1e-9
        self.free = np.flatnonzero(where[2] > floor)
        self.factor = splu(stiffness[self.free][:, self.free])
        surface = np.unique(basis.get_dofs().flatten())
        self.nodes = np.array([d for d in surface.reshape(-1, 3) if where[2, d[0]] > floor])
        self.points, self.radius_m, self.size = where[:, self.nodes[:, 0]].T, radius_m, stiffness.shape[0]

    def force(self, point: np.ndarray, normal: np.ndarray, depths_m: np.ndarray) -> np.ndarray:
        """A unit force on each node that may be touched, then who touches at each depth."""
        off = self.points - point
        near = np.flatnonzero(np.linalg.norm(off, axis=1) < NEAR_M)
        loads = np.zeros((self.size, len(near)))
        for k, dofs in enumerate(self.nodes[near]):
            loads[dofs, k] = normal
        moved = np.zeros_like(loads)
        moved[self.free] = self.factor.solve(loads[self.free])
        compliance = np.array([normal @ moved[dofs] for dofs in self.nodes[near]])
        along = off[near] @ normal
        ball = (np.linalg.norm(off[near] - along[:, None] * normal, axis=1) ** 2) / (2 * self.radius_m)
        forces = []
        for depth in depths_m:
            began = time.process_time()
            wanted, touching = depth - ball + along, depth - ball + along > 0
            push = np.zeros(len(near))
            for _ in range(50):
                push[:] = 0.0
                push[touching] = np.linalg.solve(compliance[np.ix_(touching, touching)], wanted[touching])
                again = (push > 0) | (~touching & (wanted - compliance @ push > 1e-9))
                if (again == touching).all():
                    break
                touching = again
            forces.append(push.sum())
            self.step_s, self.steps = self.step_s + time.process_time() - began, self.steps + 1
        return np.array(forces)


class Flex(Peer):
    """MuJoCo's flex: linear tetrahedra in a simulator of bodies, the ball moved by hand and left to
    settle."""

    name, made_for = "MuJoCo flex", "robots among many bodies, some of them soft"

    def __init__(self, mesh: TetMesh, young_pa: float, poisson: float, radius_m: float) -> None:
        import mujoco

        self.mujoco, self.radius_m = mujoco, radius_m
        nu = min(poisson, FLEX_POISSON)
        xml = scene_xml(
            mesh,
            radius_m,
            {"young_modulus_pa": young_pa, "poisson_ratio": nu, "friction": 0.5},
            MujocoSettings(TIMESTEP_S, 0.02),
        )
        self.model = mujoco.MjModel.from_xml_string(xml)

    def force(self, point: np.ndarray, normal: np.ndarray, depths_m: np.ndarray) -> np.ndarray:
        """The contact forces after the ball has rested at each depth."""
        data, forces, wrench = self.mujoco.MjData(self.model), [], np.zeros(6)
        last, count = -1e-3, round(SETTLE_S / TIMESTEP_S)
        for depth in depths_m:
            began = time.process_time()
            for k in range(count):
                now = last + (depth - last) * min(1.0, 2.0 * (k + 1) / count)
                data.qpos[:3], data.qvel[:3] = point + (self.radius_m - now) * normal, 0.0
                self.mujoco.mj_step(self.model, data)
            self.step_s, self.steps, last = (
                self.step_s + time.process_time() - began,
                self.steps + count,
                depth,
            )
            total = np.zeros(3)
            for c in range(data.ncon):
                self.mujoco.mj_contactForce(self.model, data, c, wrench)
                total += data.contact[c].frame.reshape(3, 3).T @ wrench[:3]
            forces.append(abs(float(total @ normal)))
        return np.array(forces)


class Newton(Peer):
    """Newton's vertex block descent: linear tetrahedra, the ball led by hand and left to settle; it touches
    faces and edges too, not nodes alone."""

    name, made_for = "Newton", "many robots at once on a graphics card, some of what they hold soft"

    def __init__(self, mesh: TetMesh, young_pa: float, poisson: float, radius_m: float) -> None:
        from palpate.render.simulators.newton import Newton as Adapter

        low = mesh.points[mesh.fixed].mean(axis=0)
        support = Support(low, np.array([0.0, 0.0, 1.0]))
        model = Model(mesh, ObjectMaterial(young_pa, poisson), support, Tool(radius_m), mesh_size_m=0.01)
        self.adapter = Adapter(model, RenderOptions(simulator_set=NEWTON_NUMBERS), 0.5)
        self.radius_m = radius_m
        far = mesh.points.max(axis=0) + 1.0
        self.adapter.begin(far, radius_m).step(NEWTON_TIMESTEP_S, far)  # compiles

    def force(self, point: np.ndarray, normal: np.ndarray, depths_m: np.ndarray) -> np.ndarray:
        """The contact forces on the ball after it has rested at each depth."""
        forces, last = [], -1e-3
        touch = self.adapter.begin(point + (self.radius_m - last) * normal, self.radius_m)
        for depth in depths_m:
            began = time.process_time()
            for k in range(NEWTON_STEPS):
                at = last + (depth - last) * min(1.0, 2.0 * (k + 1) / NEWTON_STEPS)
                push = touch.step(NEWTON_TIMESTEP_S, point + (self.radius_m - at) * normal)
            self.step_s += time.process_time() - began
            self.steps, last = self.steps + NEWTON_STEPS, depth
            forces.append(float(push @ normal))
        return np.array(forces)


PEERS: tuple[type[Peer], ...] = (Palpate, PointLoad, ByHand, Flex, Newton)


def lines_of(peer: type[Peer]) -> int:
    """Lines of code that set it up and press: without blank lines, comments and words."""
    tree = ast.parse(textwrap.dedent(inspect.getsource(peer)))
    for node in ast.walk(tree):
        body = getattr(node, "body", None)
        if isinstance(body, list) and body and isinstance(body[0], ast.Expr):
            if isinstance(getattr(body[0], "value", None), ast.Constant):
                body[:] = body[1:] or [ast.Pass()]
    return len([line for line in ast.unparse(tree).splitlines() if line.strip()])
