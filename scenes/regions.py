"""Parts of a mesh as regions of one object, each with a modulus of its own."""

from __future__ import annotations

import shlex
import warnings
from collections.abc import Mapping, Sequence

import numpy as np

from palpate.mechanics.disk.mesh_parts import Part, shares, words_of
from palpate.mechanics.errors import OptionError, PalpateWarning
from palpate.mechanics.model.material import MODULUS_LIMITS, mixed_of, points_inside
from palpate.mechanics.names import unknown
from palpate.mechanics.shape.tetmesh import TetMesh

REST = ""
"""The name under which all parts are meant that have no modulus of their own."""


class LimitedModulus(PalpateWarning):
    """A part is harder or softer than a model holds."""


def moduli_of(
    parts: Sequence[Part], stated: float | Mapping[str, float] | None, name: str
) -> dict[str, float]:
    """Pa of each part, the largest first; empty for one modulus for all, which was asked for, or of no parts.

    stated: as it was said, by name. name: of the file. Raises OptionError where a part has none, or a name is
    no part's.
    """
    if stated is not None and not isinstance(stated, Mapping):
        return {}
    stated, names = dict(stated or {}), [part.name for part in parts]
    rest = stated.pop(REST, None)
    for each in stated:
        if each not in names:
            if not parts:
                raise OptionError(f"'{name}' holds one body, and no part '{each}': say --modulus PA")
            raise OptionError(f"{unknown(each, 'part', names)}: '{name}' holds {words_of(parts)}")
    left = [each for each in names if each not in stated]
    if left and rest is None:
        flags = " ".join(f"--modulus {shlex.quote(f'{each}=PA')}" for each in left)
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
