"""A reconstructed model and its folder, which ParaView and a text editor open.

MODEL/model.toml       material, tool, mesh, frame, effects, provenance
MODEL/mesh.vtu         tetrahedra, device frame, metres; fixed, touchable, young_modulus_pa, shape uncertainty
MODEL/presses.bin      the table of presses, samples and all (mechanics.presses) MODEL/palpations.csv   one
row a palpation MODEL/compliance-*.bin the cached compliance (mechanics.compliance), keyed by content"""

from __future__ import annotations

import dataclasses
import tomllib
from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np

from mechanics.errors import MeshError, ModelError
from mechanics.files import atomic_folder
from mechanics.presses import Presses, no_presses, read_csv, read_presses, write_csv, write_presses
from mechanics.recording import dump_toml
from mechanics.tetmesh import TetMesh, vertex_normals


@dataclass(frozen=True)
class Model:
    """Everything that a renderer needs; SI units, device frame.

    young_modulus_pa: the global modulus e of eq. (13); young_modulus_ci95_pa: its 95 % interval.
    modulus_ratio: (m,) modulus of each tetrahedron over the global one (1 where homogeneous).
    support_point, support_normal: (3,), the support plane; the normal points into the object.
    shape_uncertainty_m: (n,) standard deviation of the surface along its normal at each node, or None.
    presses: the table of what was pressed. effects: parameters of every effect that a diagnosis added, by
    name. provenance: where it came from.
    """

    mesh: TetMesh
    young_modulus_pa: float
    poisson_ratio: float
    tip_radius_m: float
    mesh_size_m: float
    support_point: np.ndarray
    support_normal: np.ndarray
    young_modulus_ci95_pa: tuple[float, float] = (float("nan"), float("nan"))
    modulus_ratio: np.ndarray | None = None
    shape_uncertainty_m: np.ndarray | None = None
    presses: Presses = field(default_factory=lambda: no_presses(0.005))
    effects: Mapping[str, Mapping[str, Any]] = field(default_factory=dict)
    provenance: Mapping[str, Any] = field(default_factory=dict)
    extra: Mapping[str, Any] = field(default_factory=dict)
    path: Path | None = None

    def __post_init__(self) -> None:
        ratio = self.modulus_ratio
        ratio = np.ones(len(self.mesh.tetrahedra)) if ratio is None else np.asarray(ratio, dtype=float)
        if ratio.shape != (len(self.mesh.tetrahedra),) or not (ratio > 0).all():
            raise ModelError("modulus_ratio needs one positive value a tetrahedron")
        object.__setattr__(self, "modulus_ratio", ratio)
        for name in ("support_point", "support_normal"):
            object.__setattr__(self, name, np.asarray(getattr(self, name), dtype=float))
        if not self.young_modulus_pa > 0:
            raise ModelError(f"young_modulus_pa is {self.young_modulus_pa}; it must be greater than 0")
        if not -1 < self.poisson_ratio < 0.5:
            raise ModelError(f"poisson_ratio is {self.poisson_ratio}; it must lie between -1 and 0.5")
        if not self.tip_radius_m > 0:
            raise ModelError(f"tip_radius_m is {self.tip_radius_m}; it must be greater than 0")

    @cached_property
    def normals(self) -> np.ndarray:
        """(n, 3) outward unit normals at the nodes of the touchable surface, zero elsewhere."""
        return vertex_normals(self.mesh.points, self.mesh.touchable_surface)

    def replaced(self, **changes: Any) -> Model:
        """A copy with some fields changed."""
        return dataclasses.replace(self, **changes)


def write_model(path: Path | str, model: Model) -> Path:
    """Write the MODEL folder whole or not at all; an existing folder is replaced. Returns its path."""
    import pyvista

    path = Path(path)
    if path.exists() and not (path / "model.toml").exists() and (path.is_file() or any(path.iterdir())):
        raise ModelError(f"'{path}' exists and is no MODEL folder: name another output")
    mesh = model.mesh
    low, high = model.young_modulus_ci95_pa
    table = {
        "material": {
            "young_modulus_pa": model.young_modulus_pa,
            "young_modulus_ci95_pa": [low, high],
            "poisson_ratio": model.poisson_ratio,
        },
        "tool": {"tip_radius_m": model.tip_radius_m},
        "mesh": {
            "nodes": len(mesh.points),
            "tetrahedra": len(mesh.tetrahedra),
            "touchable_nodes": int(mesh.touchable.sum()),
            "mesh_size_m": model.mesh_size_m,
            "element_order": mesh.order,
        },
        "frame": {"support_point": model.support_point, "support_normal": model.support_normal},
        "effects": {name: dict(keys) for name, keys in model.effects.items()},
        "provenance": dict(model.provenance),
        **{name: dict(keys) for name, keys in model.extra.items()},
    }
    kind = pyvista.CellType.TETRA if mesh.order == 1 else pyvista.CellType.QUADRATIC_TETRA
    grid = pyvista.UnstructuredGrid({kind: mesh.tetrahedra}, mesh.points)
    grid.point_data["fixed"] = mesh.fixed.astype(np.uint8)
    grid.point_data["touchable"] = mesh.touchable.astype(np.uint8)
    if model.shape_uncertainty_m is not None:
        grid.point_data["shape_uncertainty_m"] = np.asarray(model.shape_uncertainty_m, dtype=float)
    grid.cell_data["young_modulus_pa"] = model.young_modulus_pa * model.modulus_ratio
    with atomic_folder(path) as folder:
        (folder / "model.toml").write_text(dump_toml(table), encoding="utf-8")
        grid.save(folder / "mesh.vtu")
        write_csv(folder / "palpations.csv", model.presses)
        write_presses(folder / "presses.bin", model.presses)
    return path


_KNOWN_TABLES = ("material", "tool", "mesh", "frame", "effects", "provenance")


def read_model(path: Path | str) -> Model:
    """Read a MODEL folder; raises ModelError where a file or key is missing or the files contradict."""
    import pyvista

    path = Path(path)
    for name in ("model.toml", "mesh.vtu", "palpations.csv"):
        if not (path / name).is_file():
            raise ModelError(
                f"'{path}' is no MODEL folder: it has no {name}; "
                "make one with 'palpate reconstruct REC -o MODEL'"
            )
    try:
        table = tomllib.loads((path / "model.toml").read_text(encoding="utf-8"))
    except (tomllib.TOMLDecodeError, UnicodeDecodeError) as error:
        raise ModelError(f"'{path / 'model.toml'}' is no valid TOML: {error}") from error
    try:
        material, frame = table["material"], table["frame"]
        grid = pyvista.read(path / "mesh.vtu")
        cells = grid.cells_dict
        tetrahedra = cells.get(int(pyvista.CellType.QUADRATIC_TETRA), cells.get(int(pyvista.CellType.TETRA)))
        if tetrahedra is None:
            raise ModelError(f"'{path / 'mesh.vtu'}' holds no tetrahedra")
        mesh = TetMesh(
            np.asarray(grid.points, dtype=float),
            tetrahedra,
            np.asarray(grid.point_data["fixed"]) > 0,
            np.asarray(grid.point_data["touchable"]) > 0,
        )
        modulus = float(material["young_modulus_pa"])
        uncertainty = grid.point_data.get("shape_uncertainty_m")
        if int(table["mesh"]["nodes"]) != len(mesh.points):
            raise ModelError(
                f"'{path}': model.toml says {table['mesh']['nodes']} nodes, "
                f"mesh.vtu holds {len(mesh.points)}: "
                "the files are of different models; reconstruct again"
            )
        ci = material.get("young_modulus_ci95_pa", [float("nan")] * 2)
        return Model(
            mesh=mesh,
            young_modulus_pa=modulus,
            young_modulus_ci95_pa=(float(ci[0]), float(ci[1])),
            poisson_ratio=float(material["poisson_ratio"]),
            tip_radius_m=float(table["tool"]["tip_radius_m"]),
            mesh_size_m=float(table["mesh"]["mesh_size_m"]),
            support_point=np.array(frame["support_point"], dtype=float),
            support_normal=np.array(frame["support_normal"], dtype=float),
            modulus_ratio=np.asarray(grid.cell_data["young_modulus_pa"], dtype=float) / modulus,
            shape_uncertainty_m=None if uncertainty is None else np.asarray(uncertainty, dtype=float),
            presses=_presses(path, float(table["tool"]["tip_radius_m"])),
            effects=table.get("effects", {}),
            provenance=table.get("provenance", {}),
            extra={k: v for k, v in table.items() if k not in _KNOWN_TABLES},
            path=path,
        )
    except KeyError as error:
        raise ModelError(f"'{path}' lacks {error}: reconstruct it again") from error
    except (MeshError, TypeError, ValueError) as error:
        raise ModelError(f"'{path}' is damaged: {error}") from error


def _presses(path: Path, tip_radius_m: float) -> Presses:
    """The table of a MODEL folder; folders of before have palpations.csv alone, without samples."""
    table = path / "presses.bin"
    return read_presses(table) if table.is_file() else read_csv(path / "palpations.csv", tip_radius_m)
