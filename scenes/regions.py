"""Parts of a mesh as regions of one object, each with a modulus of its own."""

from __future__ import annotations

import shlex
import warnings
from collections.abc import Iterable, Mapping, Sequence

import numpy as np

from palpate.mechanics.disk.mesh_parts import Part, shares, words_of
from palpate.mechanics.disk.surface_files import ClosedSurface, without_parts
from palpate.mechanics.errors import OptionError, PalpateWarning
from palpate.mechanics.model.material import MODULUS_LIMITS, mixed_of, points_inside
from palpate.mechanics.names import unknown
from palpate.mechanics.shape.tetmesh import TetMesh

REST = ""
"""The name under which all parts are meant that have no modulus of their own."""


class LimitedModulus(PalpateWarning):
    """A part is harder or softer than a model holds."""


def left_in(
    surface: ClosedSurface, stated: float | Mapping[str, float] | None
) -> tuple[ClosedSurface, float | Mapping[str, float] | None]:
    """A surface without its parts of modulus 0, and the moduli as they were stated of the others.

    Raises OptionError where a name is no part's, SurfaceError where no part is left."""
    gone = [] if not isinstance(stated, Mapping) else [name for name, pa in stated.items() if pa == 0]
    if not isinstance(stated, Mapping) or not gone:
        return surface, stated
    _check_names(stated, surface.parts, surface.name)
    left = {name: pa for name, pa in stated.items() if name not in gone}
    rest = without_parts(surface, gone)
    if rest.parts:
        return rest, left
    (only,) = (part.name for part in surface.parts if part.name not in gone)
    return rest, left.get(only, left.get(REST))


def _check_names(stated: Iterable[str], parts: Sequence[Part], name: str) -> None:
    names = [part.name for part in parts]
    for each in stated:
        if each != REST and each not in names:
            if not parts:
                raise OptionError(f"'{name}' holds one body, and no part '{each}': say --modulus PA")
            raise OptionError(f"{unknown(each, 'part', names)}: '{name}' holds {words_of(parts)}")


def flags_of(names: Iterable[str], modulus: str) -> str:
    """As the modulus of parts is typed."""
    return " ".join(f"--modulus {shlex.quote(f'{name}={modulus}')}" for name in names)


def moduli_of(
    parts: Sequence[Part], stated: float | Mapping[str, float] | None, name: str
) -> dict[str, float]:
    """Pa of each part, the largest first; empty for one modulus for all, which was asked for, or of no parts.

    stated: as it was said, by name. name: of the file. Raises OptionError where a part has none, or a name is
    no part's.
    """
    if stated is not None and not isinstance(stated, Mapping):
        return {}
    _check_names(stated or {}, parts, name)
    stated, names = dict(stated or {}), [part.name for part in parts]
    rest = stated.pop(REST, None)
    left = [each for each in names if each not in stated]
    if left and rest is None:
        flags = flags_of(left, "PA")
        one = "" if stated else ", or --modulus PA, one for all"
        raise OptionError(f"'{name}' holds {words_of(parts)}, of what modulus is each: say {flags}{one}")
    order = sorted(parts, key=lambda part: -part.volume_m3)
    others = 0.0 if rest is None else float(rest)
    return _limited({part.name: float(stated.get(part.name, others)) for part in order})


def _limited(moduli: dict[str, float]) -> dict[str, float]:
    """Within what elements of a model may have over the largest part's."""
    matrix, *others = moduli
    found = dict(moduli)
    for each in others:
        low, high = (limit * moduli[matrix] for limit in MODULUS_LIMITS)
        found[each] = float(np.clip(moduli[each], low, high))
        if found[each] != moduli[each]:
            warnings.warn(
                f"{each} is {moduli[each]:g} Pa beside {matrix} of {moduli[matrix]:g} Pa; a model holds "
                f"{MODULUS_LIMITS[0]:g} to {MODULUS_LIMITS[1]:g} times the largest part: {found[each]:g} Pa "
                "is taken",
                LimitedModulus,
                stacklevel=4,
            )
    return found


def ratio_of(mesh: TetMesh, parts: Sequence[Part], moduli: Mapping[str, float]) -> np.ndarray:
    """(m,) modulus of each tetrahedron over that of the largest part, the first of `moduli`."""
    values = np.array([moduli[part.name] for part in parts])
    return mixed_of(shares(parts, points_inside(mesh)), values / next(iter(moduli.values())))
