"""A MODEL from the shape of an object: STL, OBJ, PLY, glTF, VTP, VTU, MSH or INP, and a modulus.

The object keeps its file's frame, in metres, and stands on its flat foot (--up says which). Small and flat
holes are closed. MODEL is a folder that 'palpate touch', 'press', 'compare --model' and 'diagnose --model'
take; with a recording of the object, 'palpate reconstruct REC --shape FILE' finds the modulus instead.
"""

from __future__ import annotations

from dataclasses import KW_ONLY, dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from palpate.mechanics.disk.surface_files import is_surface_file
from palpate.mechanics.errors import OptionError
from palpate.operations._declare import REQUIRED, Call, operand, operation
from palpate.operations._shared import (
    MODEL,
    MeshFileOptions,
    given_scene,
    save_operand,
    tip_radius_operand,
)

if TYPE_CHECKING:
    from palpate.mechanics.model.model import Model


@dataclass(frozen=True)
class ModelOperands:
    """The shape, the modulus, and where the model goes."""

    shape: Any = operand(
        REQUIRED,
        "surface or mesh of the object; in Python also a triangle mesh with `vertices` and `faces`",
        metavar="FILE",
        positional=True,
        reads=True,
    )
    young_modulus_pa: float | None = operand(
        None, "Young's modulus; None: 20000", unit="Pa", flag="--modulus"
    )
    _: KW_ONLY
    save: str | Path | None = save_operand("folder of the model to write", "MODEL", MODEL, needed=True)
    tip_radius_m: float | None = tip_radius_operand("of the tool; None: 0.005")
    mesh_size_m: float | None = operand(None, "edge of the tetrahedra; None: 0.010 or an eighth", unit="m")


@operation(ModelOperands, MeshFileOptions, often="unit up")
def model_of(asked: ModelOperands, call: Call) -> Model:
    """The model of an object whose shape is known, in the frame of its file.

    shape: an STL, OBJ, PLY, glTF, VTP, VTU, MSH or INP file with lengths in `unit`, or trimesh's mesh.
    Moduli Pa, lengths m. Raises SurfaceError where the surface is open or has no flat foot.
    """
    from palpate.scenes.build import model_of_mesh
    from palpate.scenes.scene import Scene

    shape, given = asked.shape, call.values(MeshFileOptions)
    if isinstance(shape, str | Path) and not is_surface_file(Path(shape)):
        scene = given_scene(shape, call)
        shape, given = (
            scene.source,
            {name: getattr(scene, name) for name in MeshFileOptions.__dataclass_fields__},
        )
    scene = Scene("mesh", "mesh", "", tip_radius_m=asked.tip_radius_m, mesh_size_m=asked.mesh_size_m, **given)
    for name in ("young_modulus_pa", "tip_radius_m", "mesh_size_m"):
        value = getattr(scene, name)
        if value is not None and not value > 0:
            raise OptionError(f"{name} is {value}; it must be greater than 0")
    with call.progress("model") as tell:
        made = model_of_mesh(shape, scene, tell)
    return made if asked.save is None else made.save(asked.save)
