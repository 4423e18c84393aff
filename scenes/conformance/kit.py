"""The kit as files: everything that a simulator needs, nothing of this program."""

from __future__ import annotations

import hashlib
import io
import json
import zipfile
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from string import Template

import numpy as np

from palpate.mechanics.disk.writing import FolderKind, Kind, atomic_folder
from palpate.mechanics.progress import Progress, silent
from palpate.mechanics.shape.tetmesh import FACES, lone_faces
from palpate.scenes.conformance.cases import BODIES, FRICTION, POISSON, RATE_HZ, TIP_M, YOUNG_PA, Solved
from palpate.scenes.conformance.flaws import FLAWS
from palpate.scenes.conformance.truth import TipPath, cases

HERE = Path(__file__).parent
PHYSICS = {
    "young_modulus_pa": YOUNG_PA, "poisson_ratio": POISSON, "friction": FRICTION, "tip_radius_m": TIP_M,
    "up": [0.0, 0.0, 1.0],
}  # fmt: skip
_TITLE = "Palpate conformance kit"
KIT = FolderKind(
    "a conformance kit",
    "kit.json",
    Kind("a conformance kit's list", (b"{",), holds=_TITLE.encode()),
    ("kit.json", "README.md", "score.py", "ci.yml", "bodies", "paths", "truth", "examples", "adapters"),
)
VERBATIM = ("score.py", "ci.yml", *(f"adapters/{name}" for name in (
    "kit_files.py", "run_mujoco.py", "run_scikit_fem.py", "run_newton.py", "run_drake.py", "run_sofa.py",
)))  # fmt: skip
"""Files that stand here as they go into the kit."""


@dataclass(frozen=True)
class Made:
    """A kit that was written. version: of its content; size_bytes; cases: their names."""

    path: Path
    version: str
    size_bytes: int
    cases: tuple[str, ...]

    def lines(self) -> list[str]:
        """For a person."""
        return [
            f"kit {self.version}: {len(self.cases)} cases, {self.size_bytes / 1e6:.1f} MB, in {self.path}"
        ]


def write_kit(path: Path | str, progress: Progress = silent) -> Made:
    """Write the kit's folder. Raises FileError where something else is there, or it cannot be written."""
    known = cases()
    with atomic_folder(path, KIT) as folder:
        sums: dict[str, str] = {}
        size, count = 0, len(BODIES) + len(FLAWS) + 1
        for done, part in enumerate(_parts(known)):
            for name, data in part.items():
                file = folder / name
                file.parent.mkdir(parents=True, exist_ok=True)
                file.write_bytes(data)
                size += len(data)
                if name.split("/")[0] in ("bodies", "paths", "truth"):
                    sums[name] = hashlib.sha256(data).hexdigest()
            progress("writing the kit", min(done + 1, count) / count)
        text = json.dumps([sums, PHYSICS], sort_keys=True)
        version = hashlib.sha256(text.encode()).hexdigest()[:12]
        listed = {
            "title": _TITLE, "version": version, "physics": PHYSICS,
            "cases": [
                {"name": name, "body": tips[0].body.name, "tips": [tip.name for tip in tips]}
                for name, tips in known.items()
            ],
            "sha256": sums,
        }  # fmt: skip
        words = {"kit.json": json.dumps(listed, indent=1) + "\n", "README.md": readme(known, version)}
        for name, text in words.items():
            (folder / name).write_text(text, encoding="utf-8")
            size += len(text.encode())
    return Made(Path(path), version, size, tuple(known))


def _parts(known: dict[str, list[TipPath]]) -> Iterator[dict[str, bytes]]:
    tips = [tip for each in known.values() for tip in each]
    for body in BODIES:
        yield body_files(body.name, body.solved)
    yield {
        **{f"paths/{tip.name}.csv": rows("t,x,y,z", tip.t, tip.centre) for tip in tips},
        **{f"truth/{tip.name}.csv": rows("t,fx,fy,fz,bound", tip.t, tip.force, tip.bound) for tip in tips},
        **{name: (HERE / name).read_bytes() for name in VERBATIM},
    }
    for flaw, plant in FLAWS.items():
        yield {f"examples/{flaw}/{tip.name}.csv": rows("t,fx,fy,fz", tip.t, plant(tip)) for tip in tips}


def rows(head: str, *columns: np.ndarray) -> bytes:
    """A CSV of numbers; times to 1 us, lengths to 1 nm, forces to 0.1 uN."""
    table, text = np.column_stack(columns), io.StringIO()
    digits = 9 if head == "t,x,y,z" else 7
    text.write(head + "\n")
    for row in np.round(table, digits) + 0.0:
        text.write(",".join(f"{value:.10g}" for value in row) + "\n")
    return text.getvalue().encode()


def body_files(name: str, solved: Solved) -> dict[str, bytes]:
    """A body's mesh for NumPy, as VTU text, and its boundary as binary STL; the same bytes every time."""
    arrays = {key: getattr(solved, key) for key in ("points", "tetrahedra", "fixed")}
    packed = io.BytesIO()
    with zipfile.ZipFile(packed, "w", zipfile.ZIP_DEFLATED) as archive:
        for key, array in arrays.items():
            plain = io.BytesIO()
            np.save(plain, array)
            archive.writestr(zipfile.ZipInfo(f"{key}.npy", (1980, 1, 1, 0, 0, 0)), plain.getvalue())
    return {
        f"bodies/{name}.npz": packed.getvalue(),
        f"bodies/{name}.vtu": vtu(solved).encode(),
        f"bodies/{name}.stl": stl(solved),
    }


def stl(solved: Solved) -> bytes:
    """The whole boundary, outward, metres."""
    tetrahedra = solved.tetrahedra.astype(np.int64)
    faces = tetrahedra[:, FACES].reshape(-1, 3)[lone_faces(tetrahedra)]
    corner = solved.points[faces].astype(np.float32)
    table = np.zeros(len(faces), dtype=[("normal", "<3f4"), ("corner", "<(3,3)f4"), ("attribute", "<u2")])
    across = np.cross(corner[:, 1] - corner[:, 0], corner[:, 2] - corner[:, 0])
    table["normal"], table["corner"] = across / np.linalg.norm(across, axis=1, keepdims=True), corner
    head = b"metres".ljust(80) + np.uint32(len(faces)).tobytes()
    return head + table.tobytes()


def vtu(solved: Solved) -> str:
    """Linear tetrahedra as VTK's XML, with the point data `fixed`."""
    count, cells = len(solved.points), len(solved.tetrahedra)
    fixed = np.zeros(count, dtype=int)
    fixed[solved.fixed] = 1

    def array(kind: str, name: str, values: np.ndarray, width: int = 1) -> str:
        lines = "\n".join(" ".join(f"{v:.7g}" for v in row) for row in values.reshape(-1, max(width, 1)))
        many = f' NumberOfComponents="{width}"' if width == 3 else ""
        return f'<DataArray type="{kind}" Name="{name}"{many} format="ascii">\n{lines}\n</DataArray>\n'

    return (
        '<?xml version="1.0"?>\n<VTKFile type="UnstructuredGrid" version="0.1" byte_order="LittleEndian">\n'
        f'<UnstructuredGrid>\n<Piece NumberOfPoints="{count}" NumberOfCells="{cells}">\n'
        f"<Points>\n{array('Float64', 'points', solved.points, 3)}</Points>\n<Cells>\n"
        + array("Int64", "connectivity", solved.tetrahedra.astype(np.int64), 4)
        + _offsets(cells)
        + f"</Cells>\n<PointData>\n{array('Int32', 'fixed', fixed)}</PointData>\n"
        "</Piece>\n</UnstructuredGrid>\n</VTKFile>\n"
    )


def _offsets(cells: int) -> str:
    ends = " ".join(str(4 * k) for k in range(1, cells + 1))
    kinds = " ".join(["10"] * cells)
    return (
        f'<DataArray type="Int64" Name="offsets" format="ascii">\n{ends}\n</DataArray>\n'
        f'<DataArray type="UInt8" Name="types" format="ascii">\n{kinds}\n</DataArray>\n'
    )


def readme(known: dict[str, list[TipPath]], version: str) -> str:
    """The kit's own words."""
    bodies = []
    for body in BODIES:
        solved, tip = body.solved, known[body.name][0]
        place = ", ".join(f"{1e3 * x:.1f}" for x in solved.place)
        normal = ", ".join(f"{x:.3f}" for x in solved.normal)
        peak = 1e3 * np.linalg.norm(tip.force, axis=1).max()
        bodies.append(
            f"| {body.name} | {body.words} | {len(solved.points)} | ({place}) | ({normal}) | "
            f"{1e3 * body.depth_m:g} | {peak:.0f} |"
        )
    flaws = [f"| `{name}` | {(plant.__doc__ or '').strip()} |" for name, plant in FLAWS.items()]
    return Template((HERE / "README.md").read_text(encoding="utf-8")).substitute(
        version=version, young=f"{YOUNG_PA:g}", poisson=f"{POISSON:g}", friction=f"{FRICTION:g}",
        radius=f"{1e3 * TIP_M:g}", step=f"{1e3 / RATE_HZ:g}", bodies="\n".join(bodies),
        flaws="\n".join(flaws),
    )  # fmt: skip
