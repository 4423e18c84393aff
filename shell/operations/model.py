"""A MODEL from the shape of an object: STL, OBJ, PLY, glTF, VTP, VTU, MSH or INP, and a modulus.

The object keeps its file's frame, in metres, and stands on its flat foot (--up says which). Small and flat
holes are closed. MODEL is a folder that 'palpate touch', 'press', 'compare --model' and 'diagnose --model'
take; with a recording of the object, 'palpate reconstruct REC --shape FILE' finds the modulus instead.
"""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

from palpate.mechanics.disk.surface_files import is_surface_file
from palpate.mechanics.errors import OptionError
from palpate.operations._call import Call
from palpate.operations._declare import Given, argument, operation, option
from palpate.operations._shared import (
    MODEL,
    MeshFileOptions,
    given_scene,
    moduli,
    modulus_option,
    save_option,
)

if TYPE_CHECKING:
    from palpate.mechanics.model.model import Model


@operation(common="unit up")
def model_of(
    shape: Annotated[
        Any,
        argument(
            "surface or mesh of the object; in Python also a triangle mesh with `vertices` and `faces`",
            metavar="FILE",
            reads=True,
        ),
    ],
    young_modulus_pa: Annotated[float | Mapping[str, float] | None, modulus_option()] = None,
    *,
    save: Annotated[
        str | Path | None, save_option("folder of the model to write", "MODEL", MODEL, needed=True)
    ] = None,
    tip_radius_m: Annotated[float | None, option("radius of the tip; None: 0.005", unit="m")] = None,
    mesh_size_m: Annotated[
        float | None, option("edge of the tetrahedra; None: 0.010, an eighth or half the wall", unit="m")
    ] = None,
    file: Given[MeshFileOptions],
    call: Call,
) -> Model:
    """The model of an object whose shape is known, in the frame of its file.

    shape: an STL, OBJ, PLY, glTF, VTP, VTU, MSH or INP file with lengths in `unit`, or trimesh's mesh.
    Moduli Pa, lengths m. Raises SurfaceError where the surface is open or has no flat foot.
    """
    from palpate.scenes.build import model_of_mesh
    from palpate.scenes.scene import Scene

    given: dict[str, Any] = {**file, "young_modulus_pa": moduli(young_modulus_pa)}
    if isinstance(shape, str | Path) and not is_surface_file(Path(shape)):
        scene = given_scene(shape, given)
        shape, given = (
            scene.source,
            {name: getattr(scene, name) for name in MeshFileOptions.__dataclass_fields__},
        )
    scene = Scene("mesh", "mesh", "", tip_radius_m=tip_radius_m, mesh_size_m=mesh_size_m, **given)
    for name in ("tip_radius_m", "mesh_size_m"):
        value = getattr(scene, name)
        if value is not None and not value > 0:
            raise OptionError(f"{name} is {value}; it must be greater than 0")
    with call.progress("model") as show_progress:
        made = model_of_mesh(shape, scene, show_progress)
    return made if save is None else made.save(save)
