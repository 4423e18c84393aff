"""Meshing beside the other steps: the mesher is a process of its own, and what needs no mesh goes on."""

from __future__ import annotations

from concurrent.futures import Future, ThreadPoolExecutor
from contextlib import AbstractContextManager

from palpate.mechanics.shape.tetmesh import TetMesh
from palpate.reconstruction.steps.s4_surface import Surface
from palpate.reconstruction.steps.s5_mesh.meshing import Meshing, MeshingOptions, as_meshed, fill


class BackgroundMesher(AbstractContextManager["BackgroundMesher"]):
    """Fills one surface and judges the mesh, each on demand and without waiting; a context manager.

    A mesh that is known needs no filling: `known`.
    """

    def __init__(self, options: MeshingOptions) -> None:
        self._options = options
        self._pool = ThreadPoolExecutor(1)
        self._mesh: Future[TetMesh] | None = None
        self._judged: Future[Meshing] | None = None

    def __exit__(self, *_: object) -> None:
        self._pool.shutdown()

    def begin(self, surface: Surface) -> None:
        """Fill this surface, unless one is being filled."""
        if self._mesh is None:
            self._mesh = self._pool.submit(fill, surface, self._options)

    def known(self, mesh: TetMesh) -> None:
        """Take this mesh."""
        self._mesh = Future()
        self._mesh.set_result(mesh)

    def mesh(self, surface: Surface) -> TetMesh:
        """The linear mesh, which is judged against its surface from now on. Raises MeshError."""
        self.begin(surface)
        assert self._mesh is not None
        mesh = self._mesh.result()
        self._judged = self._pool.submit(as_meshed, mesh, surface)
        return mesh

    def judged(self) -> Meshing:
        """The mesh with its quality, after `mesh`."""
        assert self._judged is not None
        return self._judged.result()
