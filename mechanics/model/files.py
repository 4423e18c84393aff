"""The folder of a reconstructed model, which ParaView and a text editor open.

MODEL/model.toml       format, material, tool, mesh, frame, effects, provenance, what else is known: this
                       counts, an edited value changes the model
MODEL/mesh.vtu         tetrahedra, device frame, metres; fixed, touchable, shape uncertainty; modulus_field
                       where the material has one; young_modulus_pa, for people who look: never read back
MODEL/shape.vtp        the object's surface itself, where it is known (mechanics.shape.true_shape)
MODEL/presses.bin      the table of presses, samples and all (mechanics.presses.table)
MODEL/palpations.csv   one row a palpation, for people
MODEL/surface.vtp      what a tip meets, written by the shell (render.surface.felt_surface), keyed by content
MODEL/compliance-*.bin the cached compliance (mechanics.compliance.stored_compliance), keyed by content
MODEL/places-*.bin     that of single places (mechanics.compliance.on_demand), added to
MODEL/contact-*.bin    the contact surface (render.surface.snapping), keyed by content
MODEL/curvature-*.bin  its curvatures (render.fem.fine_surface), keyed by content"""

from __future__ import annotations

import csv
import dataclasses
import tomllib
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from palpate.mechanics.contact.dent import dent_laws
from palpate.mechanics.disk.reading import read_toml
from palpate.mechanics.disk.schema import ANY, FileKey, Named, Schema, check_table
from palpate.mechanics.disk.store import read_arrays, write_arrays
from palpate.mechanics.disk.toml_text import dump_toml
from palpate.mechanics.disk.vtk_files import read_vtk, vtk_bytes
from palpate.mechanics.disk.writing import FolderKind, Kind, atomic_file, atomic_folder
from palpate.mechanics.effects.registry import effect_keys
from palpate.mechanics.errors import CacheError, MeshError, ModelError
from palpate.mechanics.model.material import (
    BALL,
    GRADIENT,
    PLACE,
    SKIN,
    Ball,
    Gradient,
    ObjectMaterial,
    Skin,
)
from palpate.mechanics.model.model import Model, Support, Tool
from palpate.mechanics.plausible import POISSON_RATIO, SPHERE, TIP_RADIUS, YOUNG_MODULUS
from palpate.mechanics.presses.table import FITS, PRESS_COLUMNS, ROW_COLUMNS, Noise, Presses
from palpate.mechanics.recording.segments import KINDS, TimeSegment
from palpate.mechanics.shape.tetmesh import TetMesh
from palpate.mechanics.shape.true_shape import TrueShape

FORMAT = 3
"""Of model.toml; no other is read. [end] is its last table: a file without it was cut off."""

_COUNT = FileKey(int, low=1, high=10_000_000)
SCHEMA: Schema = {
    "format": FileKey(int, low=FORMAT, high=FORMAT, required=True),
    "material": {
        "young_modulus_pa": YOUNG_MODULUS,
        "young_modulus_ci95_pa": FileKey(low=0.0, high=1e12, size=2, unit="Pa", unknown=True),
        "poisson_ratio": dataclasses.replace(POISSON_RATIO, required=True),
        "dent_law": FileKey(str, choices=dent_laws()),
        "gradient": GRADIENT,
        "skin": SKIN,
        "inclusions": Named(BALL),
    },
    "tool": {"tip_radius_m": TIP_RADIUS, "tip": SPHERE},
    "mesh": {
        "nodes": FileKey(int, low=1, high=_COUNT.high, required=True),
        "tetrahedra": _COUNT,
        "touchable_nodes": _COUNT,
        "mesh_size_m": FileKey(low=1e-5, high=1.0, unit="m", required=True),
        "element_order": FileKey(int, low=1, high=2),
    },
    "frame": {
        "support_point": PLACE,
        "support_normal": FileKey(low=-1e6, high=1e6, size=3, required=True),
    },
    "effects": ANY,
    "provenance": ANY,
    "end": {"whole": FileKey(bool, required=True)},
}
"""What model.toml may hold; further tables inform and are left alone. Each effect says its own keys."""
SHAPE, FELT = "shape.vtp", "surface.vtp"
_NEEDED = ("material", "tool", "mesh", "frame")

MODEL = FolderKind(
    "a MODEL folder",
    "model.toml",
    Kind("a model.toml", (b"format = ", b"[material]"), holds=b"[material]"),
    (
        "model.toml",
        "mesh.vtu",
        "shape.vtp",
        "presses.bin",
        "palpations.csv",
        FELT,
        "*.cache",
        "compliance-*.bin",
        "places-*.bin",
        "contact-*.bin",
        "curvature-*.bin",
    ),
)
"""What `write_model` writes, and what is kept beside it later."""
_PRESSES_FORMAT = "presses 1"
CSV_COLUMNS = ("t_onset", "t_peak", "x", "y", "z", "nx", "ny", "nz", "depth", *FITS)
_PRESSES_NUMBERS = ("tip_radius_m", "sample_rate_hz", "delay_s", "delay_error_s", "block")


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
        if mesh.shape is not None:
            shell = pyvista.PolyData.from_regular_faces(mesh.shape.vertices, mesh.shape.triangles)
            (folder / SHAPE).write_bytes(vtk_bytes(shell))
        write_csv(folder / "palpations.csv", model.presses)
        write_presses(folder / "presses.bin", model.presses)
    return path


def _material_table(material: ObjectMaterial) -> dict[str, Any]:
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
    known = {name: value for name, value in table.items() if name in SCHEMA}
    check_table(known, {**SCHEMA, "effects": effect_keys()}, file, ModelError, strict=True)


def models_in(folder: Path) -> list[Path]:
    """MODEL folders that lie in a folder, by name."""
    return sorted(each.parent for each in folder.glob("*/model.toml"))


def read_model(path: Path | str) -> Model:
    """Read a MODEL folder.

    Raises ModelError where a file or key is missing, a value is impossible, the files contradict, or the
    format is another.
    """
    path = Path(path)
    for name in ("model.toml", "mesh.vtu", "presses.bin"):
        if not (path / name).is_file():
            inside = models_in(path)
            cure = f"'{inside[0]}' is one" if inside else "make one with 'palpate reconstruct REC -o MODEL'"
            raise ModelError(f"'{path}' is no MODEL folder: it has no {name}; {cure}")
    table = read_toml(path / "model.toml", ModelError)
    version = table.get("format", "none")
    if version != FORMAT:
        raise ModelError(
            f"'{path}' has format {version}; this program reads {FORMAT}: "
            "install the version that wrote it, or make it anew with 'palpate reconstruct REC -o MODEL'"
        )
    if "end" not in table:
        raise ModelError(f"'{path / 'model.toml'}' was cut off: its last table, [end], is missing")
    _checked(table, path / "model.toml")
    try:
        grid = read_vtk(path / "mesh.vtu", ModelError)
        mesh = dataclasses.replace(_mesh_of(grid), shape=_shape_of(path / SHAPE))
        if table["mesh"]["nodes"] != len(mesh.points):
            raise ModelError(
                f"model.toml says {table['mesh']['nodes']} nodes, mesh.vtu holds {len(mesh.points)}: "
                "the files are of different models; reconstruct again"
            )
        support = Support(table["frame"]["support_point"], table["frame"]["support_normal"])
        uncertainty = grid.point_data.get("shape_uncertainty_m")
        return Model(
            mesh=mesh,
            material=_material_of(table["material"], grid.cell_data.get("modulus_field")),
            support=support,
            tool=Tool(table["tool"]["tip_radius_m"]),
            mesh_size_m=float(table["mesh"]["mesh_size_m"]),
            shape_uncertainty_m=None if uncertainty is None else np.asarray(uncertainty, dtype=float),
            presses=read_presses(path / "presses.bin"),
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


def _shape_of(path: Path) -> TrueShape | None:
    """The shape beside the mesh; None where the model has none."""
    if not path.is_file():
        return None
    shell = read_vtk(path, ModelError)
    if not shell.n_cells:
        raise ModelError(f"{SHAPE} holds no triangles")
    return TrueShape(np.asarray(shell.points, dtype=float), shell.regular_faces)


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


def _material_of(keys: Mapping[str, Any], ratios: np.ndarray | None) -> ObjectMaterial:
    """From [material], checked, and the field of mesh.vtu."""
    parts: dict[str, Any] = dict(keys)
    if "gradient" in keys:
        parts["gradient"] = Gradient(**keys["gradient"])
    if "skin" in keys:
        parts["skin"] = Skin(**keys["skin"])
    if "inclusions" in keys:
        parts["inclusions"] = {name: Ball(**ball) for name, ball in keys["inclusions"].items()}
    return ObjectMaterial(**parts, field=ratios)


def write_csv(path: Path | str, presses: Presses) -> None:
    """Write `palpations.csv`: a row a press, the contract's columns, SI units, device frame."""
    table = np.column_stack(
        [presses.onset_s, presses.peak_s, presses.point, presses.normal, presses.depth_m]
        + [presses.fits[n] for n in FITS]
    )
    with atomic_file(path) as temporary, open(temporary, "w", newline="", encoding="utf-8") as file:
        writer = csv.writer(file, lineterminator="\n")
        writer.writerow(CSV_COLUMNS)
        writer.writerows([repr(float(v)) for v in row] for row in table)


def write_presses(path: Path, presses: Presses) -> None:
    """Write the table as it stands, samples and all (views with further columns lose those)."""
    arrays = {
        n: getattr(presses, n) for n in (*ROW_COLUMNS, *PRESS_COLUMNS) if getattr(presses, n) is not None
    }
    arrays |= {f"fit {n}": v for n, v in presses.fits.items()}
    arrays["numbers"] = np.array([float(getattr(presses, n)) for n in _PRESSES_NUMBERS])
    arrays["noise"] = np.array(dataclasses.astuple(presses.noise))
    arrays["segments"] = np.array(
        [[KINDS.index(s.kind), s.start_s, s.end_s] for s in presses.segments], dtype=float
    ).reshape(-1, 3)
    arrays["recording"] = np.frombuffer(presses.recording.encode(), dtype=np.uint8)
    write_arrays(path, _PRESSES_FORMAT, arrays)


def read_presses(path: Path) -> Presses:
    """Read what `write_presses` wrote; raises ModelError where the file is damaged."""
    try:
        arrays = read_arrays(path, _PRESSES_FORMAT)
        named: dict[str, Any] = {
            n: np.array(arrays[n]) for n in (*ROW_COLUMNS, *PRESS_COLUMNS) if n in arrays
        }
        named |= zip(_PRESSES_NUMBERS, arrays["numbers"].tolist(), strict=True)
        named["block"] = int(named["block"])
        return Presses(
            **named,
            fits={n: np.array(arrays[f"fit {n}"]) for n in FITS},
            noise=Noise(*arrays["noise"].tolist()),
            segments=tuple(TimeSegment(KINDS[int(k)], a, b) for k, a, b in arrays["segments"].tolist()),
            recording=bytes(arrays["recording"]).decode(),
        )
    except (CacheError, KeyError, ValueError, TypeError, IndexError) as error:
        raise ModelError(f"'{path}' is damaged ({error}): reconstruct the model again") from error
