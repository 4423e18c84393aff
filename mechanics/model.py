"""A reconstructed model and its folder, which ParaView and a text editor open.

MODEL/model.toml       format, material, tool, mesh, frame, effects, provenance, what else is known: this
                       counts, an edited value changes the model
MODEL/mesh.vtu         tetrahedra, device frame, metres; fixed, touchable, shape uncertainty; modulus_field
                       where the material has one; young_modulus_pa, for people who look: never read back
MODEL/presses.bin      the table of presses, samples and all (mechanics.presses)
MODEL/palpations.csv   one row a palpation
MODEL/surface.vtp      what a tip meets, written by the shell (render.felt), keyed by content
MODEL/compliance-*.bin the cached compliance (mechanics.compliance), keyed by content"""

from __future__ import annotations

import dataclasses
import tomllib
from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np

from mechanics.dent import dent_laws
from mechanics.errors import MeshError, ModelError
from mechanics.files import FolderKind, Kind, atomic_folder, read_toml
from mechanics.material import (
    BALL,
    GRADIENT,
    PLACE,
    SKIN,
    UNKNOWN,
    Ball,
    Gradient,
    Material,
    Skin,
    finite,
    positive,
)
from mechanics.moduli import balls_ratio, gradient_ratio, skin_ratio, with_balls, within_limits
from mechanics.press_files import read_csv, read_presses, write_csv, write_presses
from mechanics.press_making import no_presses
from mechanics.presses import Presses
from mechanics.recording import POISSON, TIP_RADIUS, dump_toml
from mechanics.result import Result
from mechanics.schema import ANY, Key, Named, Schema, check_table
from mechanics.tetmesh import TetMesh, vertex_normals
from mechanics.vtk_files import read_vtk, vtk_bytes

FORMAT = 3
"""Of model.toml. 1, which states none: moduli of elements in mesh.vtu, [inclusions], the dent law in
[provenance]. 2: no [end], the last table, without which a file of format 3 was cut off."""

_MODULUS = Key(low=1.0, high=1e9, unit="Pa", required=True)
_COUNT = Key(int, low=1, high=10_000_000)
SCHEMA: Schema = {
    "format": Key(int, low=1, high=FORMAT),
    "material": {
        "young_modulus_pa": _MODULUS,
        "young_modulus_ci95_pa": Key(low=0.0, high=1e12, size=2, unit="Pa", unknown=True),
        "poisson_ratio": Key(low=POISSON.low, high=POISSON.high, required=True),
        "dent_law": Key(str, choices=dent_laws()),
        "gradient": GRADIENT,
        "skin": SKIN,
        "inclusions": Named(BALL),
    },
    "tool": {"tip_radius_m": TIP_RADIUS},
    "mesh": {
        "nodes": Key(int, low=1, high=_COUNT.high, required=True),
        "tetrahedra": _COUNT,
        "touchable_nodes": _COUNT,
        "mesh_size_m": Key(low=1e-5, high=1.0, unit="m", required=True),
        "element_order": Key(int, low=1, high=2),
    },
    "frame": {
        "support_point": PLACE,
        "support_normal": Key(low=-1e6, high=1e6, size=3, required=True),
    },
    "effects": ANY,
    "provenance": ANY,
    "end": {"whole": Key(bool, required=True)},
}
"""What model.toml may hold; further tables inform and are left alone. Each effect says its own keys."""
_NEEDED = ("material", "tool", "mesh", "frame")

MODEL = FolderKind(
    "a MODEL folder",
    "model.toml",
    Kind("a model.toml", (b"format = ", b"[material]"), holds=b"[material]"),
    ("model.toml", "mesh.vtu", "presses.bin", "palpations.csv", "surface.vtp", "*.cache", "compliance-*.bin"),
)
"""What `write_model` writes, and what is kept beside it later."""


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
    material: Material
    support: Support
    tool: Tool
    mesh_size_m: float
    shape_uncertainty_m: np.ndarray | None = None
    presses: Presses = field(default_factory=lambda: no_presses(0.005))
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

    def save(self, path: Path | str) -> Model:
        """Write a MODEL folder that ParaView opens, and return the model that knows it.

        What is computed for the model later, its compliance, is kept there. Raises ModelError where the
        folder exists and holds something else.
        """
        return self.replaced(path=write_model(path, self))

    @cached_property
    def normals(self) -> np.ndarray:
        """(n, 3) outward unit normals at the nodes of the touchable surface, zero elsewhere."""
        return vertex_normals(self.mesh.points, self.mesh.touchable_surface)

    @cached_property
    def element_ratio(self) -> np.ndarray:
        """(m,) modulus of each tetrahedron over the global one, of all parts of the material."""
        return with_balls(self.mesh, self.ratio_without_balls, self.material.inclusions.values())

    @cached_property
    def ratio_without_balls(self) -> np.ndarray:
        """(m,) of what the balls lie in, for meshes on which they are drawn by themselves."""
        skin = self.material.skin
        if skin is None:
            return self.surface_ratio
        return within_limits(self._bulk_ratio * skin_ratio(self.mesh, skin))

    @cached_property
    def surface_ratio(self) -> np.ndarray:
        """(m,) of what a dent meets beside its law: without balls, which lie inside, and without the skin."""
        return within_limits(self._bulk_ratio)

    @cached_property
    def _bulk_ratio(self) -> np.ndarray:
        material, ratio = self.material, np.ones(len(self.mesh.tetrahedra))
        if material.field is not None:
            ratio = ratio * material.field
        if material.gradient is not None:
            ratio = ratio * gradient_ratio(
                self.mesh, material.gradient, self.support.point, self.support.normal
            )
        return ratio

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


def write_model(path: Path | str, model: Model) -> Path:
    """Write the MODEL folder whole or not at all; an existing one is replaced, and what others put into it
    stays. Returns its path.

    Raises FileError where something else is there or the disk refuses, ModelError for values that no reader
    would take.
    """
    import pyvista

    path = Path(path)
    mesh, material = model.mesh, model.material
    table = {
        "format": FORMAT,
        "material": _material_table(material),
        "tool": {"tip_radius_m": model.tool.tip_radius_m},
        "mesh": {
            "nodes": len(mesh.points),
            "tetrahedra": len(mesh.tetrahedra),
            "touchable_nodes": int(mesh.touchable.sum()),
            "mesh_size_m": model.mesh_size_m,
            "element_order": mesh.order,
        },
        "frame": {"support_point": model.support.point, "support_normal": model.support.normal},
        "effects": {name: dict(keys) for name, keys in model.effects.items()},
        "provenance": dict(model.provenance),
        **{name: dict(keys) for name, keys in model.about.items()},
        "end": {"whole": True},
    }
    text = dump_toml(table)
    _checked(tomllib.loads(text), path / "model.toml")
    kind = pyvista.CellType.TETRA if mesh.order == 1 else pyvista.CellType.QUADRATIC_TETRA
    grid = pyvista.UnstructuredGrid({kind: mesh.tetrahedra}, mesh.points)
    grid.point_data["fixed"] = mesh.fixed.astype(np.uint8)
    grid.point_data["touchable"] = mesh.touchable.astype(np.uint8)
    if model.shape_uncertainty_m is not None:
        grid.point_data["shape_uncertainty_m"] = np.asarray(model.shape_uncertainty_m, dtype=float)
    grid.cell_data["young_modulus_pa"] = material.young_modulus_pa * model.element_ratio
    if material.field is not None:
        grid.cell_data["modulus_field"] = material.field
    with atomic_folder(path, MODEL) as folder:
        (folder / "model.toml").write_text(text, encoding="utf-8")
        (folder / "mesh.vtu").write_bytes(vtk_bytes(grid))
        write_csv(folder / "palpations.csv", model.presses)
        write_presses(folder / "presses.bin", model.presses)
    return path


def _material_table(material: Material) -> dict[str, Any]:
    """[material] and its tables; parts that are not there are left out."""
    parts = {name: getattr(material, name) for name in ("gradient", "skin")}
    return {
        "young_modulus_pa": material.young_modulus_pa,
        "young_modulus_ci95_pa": list(material.young_modulus_ci95_pa),
        "poisson_ratio": material.poisson_ratio,
        "dent_law": material.dent_law,
        **{name: dataclasses.asdict(part) for name, part in parts.items() if part is not None},
        "inclusions": {name: dataclasses.asdict(ball) for name, ball in material.inclusions.items()} or None,
    }


def _checked(table: dict[str, Any], file: Path) -> None:
    """Raise ModelError for what SCHEMA does not allow; tables that it does not know are left alone."""
    for name in _NEEDED:
        if name not in table:
            raise ModelError(f"'{file}' lacks [{name}]: it was cut off or is none; reconstruct it again")
    from mechanics.effects.registry import effect_keys  # effects act on models

    known = {name: value for name, value in table.items() if name in SCHEMA}
    check_table(known, {**SCHEMA, "effects": effect_keys()}, file, ModelError, strict=True)


def read_model(path: Path | str) -> Model:
    """Read a MODEL folder; one of an older format is converted.

    Raises ModelError where a file or key is missing, a value is impossible, the files contradict, or the
    format is newer than this program.
    """
    path = Path(path)
    for name in ("model.toml", "mesh.vtu", "palpations.csv"):
        if not (path / name).is_file():
            raise ModelError(
                f"'{path}' is no MODEL folder: it has no {name}; "
                "make one with 'palpate reconstruct REC -o MODEL'"
            )
    table = read_toml(path / "model.toml", ModelError)
    version = table.get("format", 1)
    if version not in range(1, FORMAT + 1):
        raise ModelError(
            f"'{path}' has format {version}; this program reads 1 to {FORMAT}: "
            "install the version that wrote it, or make it anew with 'palpate reconstruct REC -o MODEL'"
        )
    if version == FORMAT and "end" not in table:
        raise ModelError(f"'{path / 'model.toml'}' was cut off: its last table, [end], is missing")
    _checked(table, path / "model.toml")
    try:
        grid = read_vtk(path / "mesh.vtu", ModelError)
        mesh = _mesh_of(grid)
        if table["mesh"]["nodes"] != len(mesh.points):
            raise ModelError(
                f"model.toml says {table['mesh']['nodes']} nodes, mesh.vtu holds {len(mesh.points)}: "
                "the files are of different models; reconstruct again"
            )
        support = Support(table["frame"]["support_point"], table["frame"]["support_normal"])
        uncertainty = grid.point_data.get("shape_uncertainty_m")
        if version == 1:
            drawn = np.asarray(grid.cell_data["young_modulus_pa"], dtype=float)
            table["material"] = _material_of_format_1(table, mesh, support, drawn)
        else:
            table["material"] = _material_of(table["material"], grid.cell_data.get("modulus_field"))
        return Model(
            mesh=mesh,
            material=table["material"],
            support=support,
            tool=Tool(table["tool"]["tip_radius_m"]),
            mesh_size_m=float(table["mesh"]["mesh_size_m"]),
            shape_uncertainty_m=None if uncertainty is None else np.asarray(uncertainty, dtype=float),
            presses=_presses(path, float(table["tool"]["tip_radius_m"])),
            effects=table.get("effects", {}),
            provenance=table.get("provenance", {}),
            about={k: v for k, v in table.items() if k not in SCHEMA and isinstance(v, dict)},
            path=path,
        )
    except ModelError as error:
        raise ModelError(f"'{path}': {error}") from error
    except KeyError as error:
        raise ModelError(f"'{path}' lacks {error}: reconstruct it again") from error
    except (MeshError, TypeError, ValueError, AttributeError, IndexError, OverflowError) as error:
        raise ModelError(f"'{path}' is damaged: {error}") from error


def _mesh_of(grid: Any) -> TetMesh:
    """The mesh in a VTK grid; raises ModelError where it has no tetrahedra."""
    import pyvista

    cells = grid.cells_dict
    tetrahedra = cells.get(int(pyvista.CellType.QUADRATIC_TETRA), cells.get(int(pyvista.CellType.TETRA)))
    if tetrahedra is None:
        raise ModelError("mesh.vtu holds no tetrahedra")
    return TetMesh(
        np.asarray(grid.points, dtype=float),
        tetrahedra,
        np.asarray(grid.point_data["fixed"]) > 0,
        np.asarray(grid.point_data["touchable"]) > 0,
    )


def _material_of(keys: Mapping[str, Any], ratios: np.ndarray | None = None) -> Material:
    """From [material], checked, and the field of mesh.vtu."""
    parts: dict[str, Any] = dict(keys)
    if "gradient" in keys:
        parts["gradient"] = Gradient(**keys["gradient"])
    if "skin" in keys:
        parts["skin"] = Skin(**keys["skin"])
    if "inclusions" in keys:
        parts["inclusions"] = {name: Ball(**ball) for name, ball in keys["inclusions"].items()}
    return Material(**parts, field=ratios)


def _material_of_format_1(
    table: dict[str, Any], mesh: TetMesh, support: Support, element_modulus_pa: np.ndarray
) -> Material:
    """What format 1 spread over tables, typed; takes out of `table` what it typed.

    It multiplied gradient, skin and balls into the moduli of the elements (m,) Pa: what these parts do not
    draw becomes the field.
    """
    effects, provenance = table.get("effects", {}), table.get("provenance", {})
    keys = {**table["material"], "dent_law": provenance.pop("dent_law", "linear")}
    if "finite_strain" in effects:
        keys["dent_law"] = "neo-hookean"
    keys["inclusions"] = table.pop("inclusions", {})
    for part, effect in (("gradient", "modulus_gradient"), ("skin", "skin_layer")):
        if effect in effects:
            keys[part] = effects[effect]
    material = _material_of(keys)
    ratio = balls_ratio(mesh, material.inclusions.values())
    if material.gradient is not None:
        ratio = ratio * gradient_ratio(mesh, material.gradient, support.point, support.normal)
    if material.skin is not None:
        ratio = ratio * skin_ratio(mesh, material.skin)
    rest = element_modulus_pa / (material.young_modulus_pa * within_limits(ratio))
    if np.abs(rest - 1).max() < 1e-6:
        return material
    return dataclasses.replace(material, field=rest)


def _presses(path: Path, tip_radius_m: float) -> Presses:
    """The table of a MODEL folder; folders of before have palpations.csv alone, without samples."""
    table = path / "presses.bin"
    return read_presses(table) if table.is_file() else read_csv(path / "palpations.csv", tip_radius_m)
