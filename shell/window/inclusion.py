"""A stiff ball that is moved about inside an object: a low-rank change of the compliance, no new precompute.

The change is exact for the model's own mesh (mechanics.elastic.inclusion), under the patches of both of the
servo's tables, and interpolated to the contact surface; a table made from the start has a finer mesh under
the skin.
"""

from __future__ import annotations

import shutil
import tempfile
from pathlib import Path

import numpy as np
import scipy.sparse as sp

from palpate.mechanics.compliance.near_field import contact_width
from palpate.mechanics.compliance.patch import PatchSampler
from palpate.mechanics.disk.scratch import memory_folder, temporary_prefix
from palpate.mechanics.effects.hold import base_hold
from palpate.mechanics.elastic import inclusion
from palpate.mechanics.elastic.solver import Solver
from palpate.mechanics.model.material import balls_ratio
from palpate.mechanics.model.model import Model
from palpate.mechanics.progress import Progress, silent
from palpate.mechanics.shape.nearest import closest
from palpate.render.base import Renderer
from palpate.render.fem.renderer import FemRenderer
from palpate.scenes.phantoms import Region
from palpate.scenes.scene import ball_of
from palpate.servo import Servo
from palpate.servo.source import FieldChange


class MovingInclusion:
    """model: the object without the ball; renderer: of that object, at any modulus."""

    def __init__(self, model: Model, renderer: FemRenderer, progress: Progress = silent) -> None:
        progress("factorising the object", 0.0)
        compliance = renderer.whole_compliance
        self._mesh = model.mesh.quadratic()
        material = model.material
        hold = base_hold(model.effects, model.support.normal, material.young_modulus_pa)
        nu, stretch = material.poisson_ratio, model.stretch_m
        self._solver = Solver(self._mesh, nu, model.solid_ratio, hold=hold, stretch_m=stretch)
        progress("spreading the touch", 0.3)
        wide = PatchSampler(self._mesh, float(compliance.patch_width_m[0])).matrix(compliance.points)
        width = min(contact_width(model.tool.tip_radius_m), float(compliance.own_width_m[0]))
        narrow = PatchSampler(self._mesh, width).matrix(compliance.own_points)
        self._outputs = sp.vstack([wide, narrow], format="csr")
        self._mutual = 3 * len(compliance.points)  # rows of the wide patches
        self._plain_far = renderer.parameters.far
        self._blocks = compliance.blocks
        self._touched = np.flatnonzero(np.abs(self._plain_far).any(axis=(1, 2)))
        vertices = renderer.surface[0][self._touched]
        points, triangles = compliance.own_points, compliance.own_triangles
        _, triangle, self._weights = closest(points, triangles, vertices)
        self._corners = triangles[triangle]
        self._region: inclusion.StiffenedElements | None = None

    def write(self, region: Region | None, path: Path, progress: Progress = silent) -> FieldChange:
        """The change that a ball makes, None: the plain object. Solves only for elements not met before."""
        far, blocks = self._plain_far, self._blocks
        if region is not None:
            far, blocks = self._changed(balls_ratio(self._mesh, [ball_of(region)]), progress)
        return FieldChange.written(path, far, blocks)

    def _changed(self, ratio: np.ndarray, progress: Progress) -> tuple[np.ndarray, np.ndarray]:
        elements = np.flatnonzero(ratio != 1.0)
        if not len(elements):  # outside the object
            return self._plain_far, self._blocks
        if self._region is None:
            self._region = inclusion.StiffenedElements(
                self._solver, elements, self._outputs, progress=progress
            )
        else:
            self._region.extend(elements, progress)
        basis, change = self._region.change(ratio[self._region.elements])
        own = basis[self._mutual :].reshape(-1, 3, basis.shape[1])
        less = (own @ change.astype(own.dtype)) @ own.transpose(0, 2, 1)
        far = np.array(self._plain_far)
        far[self._touched] -= np.einsum("vc,vcab->vab", self._weights, less[self._corners])
        blocks = self._blocks
        if len(blocks):
            wide, t = basis[: self._mutual], self._mutual // 3
            moved = ((wide @ change.astype(wide.dtype)) @ wide.T).reshape(t, 3, t, 3)
            blocks = blocks - moved.transpose(0, 2, 1, 3)
        return far, blocks


class InclusionMover:
    """Where the ball is wanted, and where it is felt: of places that follow one another quickly, the newest.

    wanted: set at any time, None for no ball. model: the object without it.
    """

    def __init__(self, model: Model) -> None:
        self.wanted: Region | None = None
        self._placed: Region | None = None
        self._model = model
        self._moving: MovingInclusion | None = None
        self._change: FieldChange | None = None
        self._folder = Path(tempfile.mkdtemp(prefix=temporary_prefix("touch-"), dir=memory_folder()))
        self._count = 0

    @property
    def settled(self) -> bool:
        """Whether it is felt where it is wanted."""
        return self._placed == self.wanted

    def follow(self, servo: Servo, drawing: FemRenderer, progress: Progress = silent) -> FemRenderer:
        """Compute the newest wanted place and let it be felt; returns `drawing` on the changed object.

        Where that fails, the ball is wanted where it is felt.
        """
        wanted, before = self.wanted, self._change
        self._count += 1
        try:
            self._moving = self._moving or MovingInclusion(self._model, drawing, progress)
            self._change = self._moving.write(wanted, self._folder / f"field-{self._count}.npz", progress)
            self.apply(servo)
        except Exception:
            self.wanted = self._placed
            raise
        if before is not None:
            before.path.unlink()
        self._placed = wanted
        return self._change.laid_on(drawing)

    def laid_on(self, renderer: Renderer) -> Renderer:
        """A renderer that was made anew, with the ball that is felt."""
        return renderer if self._change is None else self._change.changed(renderer)

    def apply(self, servo: Servo) -> None:
        """To a renderer that the servo has got anew."""
        if self._change is not None:
            servo.change(self._change)

    def close(self) -> None:
        """Remove what was written."""
        shutil.rmtree(self._folder, ignore_errors=True)
