"""Whether the felt surface is the shape, whatever the mesh: its distance from the true one, and how far a
place's force moves from mesh to mesh.

Shapes that are known exactly, as files of chords (benchmarks._known_shapes), are meshed at several sizes,
several times each; the tip (radius 5 mm) presses straight into places of the true surface, by depths below
it. Only the places' own compliance is solved for.
"""

from __future__ import annotations

import argparse
from collections.abc import Sequence
from typing import Any, Protocol

import numpy as np

from benchmarks._known_shapes import SHAPES, KnownShape
from benchmarks.evidence import Figure
from benchmarks.timing import table
from palpate.mechanics.model.material import ObjectMaterial
from palpate.mechanics.model.model import Model, Support, Tool
from palpate.mechanics.shape.flat_foot import Standing
from palpate.mechanics.shape.nearest import sample
from palpate.mechanics.shape.tetmesh import TetMesh
from palpate.mechanics.shape.true_shape import TrueShape
from palpate.output import progress_bar
from palpate.reconstruction.shapes.drawing import decimated
from palpate.reconstruction.steps.s4_surface import Surface
from palpate.reconstruction.steps.s5_mesh.meshing import MeshingOptions, fill
from palpate.render.base import Renderer
from palpate.render.registry import create
from palpate.render.surface.contact_surface import contact_surface

TIP_M, MODULUS_PA, NU = 0.005, 20e3, 0.49
DEPTHS_M = (0.001, 0.003, 0.006)
REACHED_M = 0.003
"""Height over the support from which a tip can touch."""
RIM_M = 0.008
"""Within this of a sharp edge a place counts as at a rim."""
_UP = np.array([0.0, 0.0, 1.0])


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Which shapes and meshes."""
    parser.add_argument("--shapes", nargs="+", choices=tuple(SHAPES), default=list(SHAPES))
    parser.add_argument("--sizes-mm", nargs="+", type=float, default=[12.0, 10.0, 7.0, 5.0])
    parser.add_argument("--meshes", type=int, default=2, help="of each size (default: 2)")
    parser.add_argument("--places", type=int, default=20, help="of each shape (default: 20)")


def run(arguments: argparse.Namespace) -> dict[str, Any]:
    """Measure; print two tables; return the figures."""
    progress, found = progress_bar("meshes"), {}
    count = len(arguments.shapes) * len(arguments.sizes_mm) * arguments.meshes
    for name in arguments.shapes:
        shape = SHAPES[name]()
        points, normals = shape.places(arguments.places)
        for size in arguments.sizes_mm:
            for k in range(arguments.meshes):
                mesh = meshed(shape, 1e-3 * size)
                found[f"{name} {size:g} {k}"] = measured(shape, mesh, points, normals)
                progress("meshes", len(found) / count)
    progress.close()
    return report(found, [SHAPES[name]() for name in arguments.shapes], arguments.places)


class Given(Protocol):
    """A closed surface: vertices (n, 3) m, triangles (m, 3) outward."""

    @property
    def vertices(self) -> np.ndarray: ...
    @property
    def triangles(self) -> np.ndarray: ...


def meshed(shape: Given, size_m: float) -> TetMesh:
    """A mesh of the shape's file."""
    stood = Standing(shape.vertices, shape.triangles, np.zeros(3), _UP)
    surface = Surface(
        vertices=stood.vertices, triangles=stood.triangles, uncertainty_m=np.zeros(len(stood.vertices)),
        support_point=stood.support_point, support_normal=_UP, method="known", reason="the shape is given",
        redraw=lambda edge_m: decimated(stood, edge_m), shape=TrueShape(stood.vertices, stood.triangles),
    )  # fmt: skip
    return fill(surface, MeshingOptions(mesh_size_m=size_m))


def measured(
    shape: KnownShape, mesh: TetMesh, points: np.ndarray, normals: np.ndarray
) -> dict[str, np.ndarray]:
    """off_m: of samples of the felt surface from the true one, with rim (bool) beside it; force_n (places,
    depths): along the normal."""
    arrays = contact_surface(mesh).arrays
    felt = sample(arrays.vertices, arrays.triangles[arrays.free > 0], 20_000)
    felt = felt[felt[:, 2] > REACHED_M]
    return {
        "off_m": shape.distance(felt),
        "rim": shape.rim_distance(felt) < RIM_M,
        "force_n": forces(mesh, points, normals),
    }


def forces(mesh: TetMesh, points: np.ndarray, normals: np.ndarray) -> np.ndarray:
    """(places, depths) N along the normal, straight presses from outside to each depth below the points."""
    renderer = create("fem", standing(mesh), on_demand=True)
    return straight_in(renderer, points, normals, np.array(DEPTHS_M))


def standing(mesh: TetMesh, nu: float = NU, dent_law: str = "linear") -> Model:
    """The model of a mesh that stands on z = 0."""
    return Model(
        mesh=mesh.quadratic(), material=ObjectMaterial(MODULUS_PA, nu, dent_law=dent_law),
        support=Support(np.zeros(3), _UP), tool=Tool(TIP_M), mesh_size_m=0.01,
    )  # fmt: skip


def straight_in(
    renderer: Renderer, points: np.ndarray, normals: np.ndarray, depths_m: np.ndarray
) -> np.ndarray:
    """(places, depths) N along the normal as rendered, the tip coming from outside."""
    way = np.linspace(-0.002, depths_m[-1], 101)
    result = np.empty((len(points), len(depths_m)))
    for row, point, normal in zip(result, points, normals, strict=True):
        path = point + (TIP_M - way)[:, None] * normal
        force = renderer.follow(renderer.start([TIP_M]), path[:, None], np.full(len(way), 10.0))[:, 0]
        row[:] = np.interp(depths_m, way, force @ normal)
    return result


def report(
    found: dict[str, dict[str, np.ndarray]], shapes: Sequence[KnownShape], places: int
) -> dict[str, Any]:
    """Print distances by mesh and spreads of force by shape; return both with the figures."""
    rows = []
    for name, one in found.items():
        every = 1e3 * np.abs(one["off_m"])
        off, rim = every[~one["rim"]], every[one["rim"]]
        rows.append(
            [name, f"{np.sqrt((off**2).mean()):.4f}", f"{np.percentile(off, 95):.4f}", f"{off.max():.4f}",
             f"{rim.max():.4f}" if len(rim) else ""]
        )  # fmt: skip
    print(table(["mesh", "rms mm", "95 % mm", "max mm", "max at rims mm"], rows))
    print()
    rows, spreads = [], []
    for shape in shapes:
        force = np.array([one["force_n"] for name, one in found.items() if name.split()[0] == shape.name])
        spread = 100 * np.ptp(force, axis=0) / np.maximum(force.mean(axis=0), 1e-9)
        rim = shape.rim_distance(shape.places(places)[0]) < RIM_M
        for kind, chosen in (("face", ~rim), ("rim", rim)):
            if chosen.any() and len(force) > 1:
                part = spread[chosen]
                spreads.append(part)
                rows.append([f"{shape.name}, {kind}", str(chosen.sum()), str(len(force))])
                rows[-1] += [
                    f"{np.percentile(part[:, d], 95):.2f} / {part[:, d].max():.2f}" for d in range(3)
                ]
    deep = [f"{1e3 * d:g} mm: 95 % / max, %" for d in DEPTHS_M]
    print(table(["place", "places", "meshes", *deep], rows))
    off = 1e3 * np.abs(np.concatenate([one["off_m"] for one in found.values()]))
    rim = np.concatenate([one["rim"] for one in found.values()])
    figures = [
        Figure(
            "felt from true surface, greatest on faces and fillets", float(off[~rim].max()), unit="mm"
        ).at_most(0.02),
        Figure(
            "felt from true surface, rms on faces and fillets",
            float(np.sqrt((off[~rim] ** 2).mean())),
            unit="mm",
        ),
    ]
    if rim.any():
        figures.append(
            Figure(
                "felt from true surface, greatest within 8 mm of a sharp edge",
                float(off[rim].max()),
                unit="mm",
            ).at_most(0.02)
        )
    if spreads:
        every = np.concatenate(spreads)
        figures.append(
            Figure("force of a place over meshes, greatest spread", float(every.max()), unit="%").at_most(1.5)
        )
        figures.append(
            Figure("force of a place over meshes, 95 % of spreads", float(np.percentile(every, 95)), unit="%")
        )
    kept = {name: {"max_mm": float(1e3 * np.abs(one["off_m"]).max()), "force_n": one["force_n"].tolist()}
            for name, one in found.items()}  # fmt: skip
    return {"meshes": kept, "figures": figures}
