"""A simulator's tuned settings in a file of its own: MuJoCo's a scene that holds them, Newton's and Drake's
a script that presses with them; scikit-fem has no file of settings, so its script names them."""

from __future__ import annotations

import json
from pathlib import Path

from palpate.diagnosis.other_simulator.tuned import Tuned
from palpate.exporting import mujoco, scripts
from palpate.exporting.subject import subject_of
from palpate.mechanics.disk.writing import Kind, atomic_file
from palpate.mechanics.errors import OptionError
from palpate.render.simulators.base import ScriptedAdapter, over
from palpate.render.simulators.drake import Drake
from palpate.render.simulators.newton import Newton

SETTINGS = Kind("settings of palpate tune", (b"<!-- Palpate", b"# Palpate"))
SUFFIXES = {"mujoco": ".xml", "scikit-fem": ".py", "drake": ".py", "newton": ".py"}
_SCRIPTED: dict[str, type[ScriptedAdapter]] = {"drake": Drake, "newton": Newton}


def check_suffix(simulator: str, path: Path | str) -> None:
    """Raise OptionError for another suffix than that simulator's files have."""
    if Path(path).suffix.lower() != SUFFIXES[simulator]:
        raise OptionError(f"'{path}' must end in {SUFFIXES[simulator]} for {simulator}")


def write_settings(path: Path | str, tuned: Tuned) -> Path:
    """Write them. Raises OptionError for another suffix, FileError where something else is there."""
    check_suffix(tuned.simulator, path)
    subject, numbers = subject_of(tuned.model), over(tuned.numbers, tuned.settings)
    moved = "; ".join(f"{m.term}: {m.before:g} -> {m.after:g}" for m in tuned.moved) or "nothing moved"
    if tuned.simulator == "mujoco":
        mark = f"<!-- Palpate tuned settings: {moved.replace('--', '- -')} -->\n"
        subject = subject_of(tuned.model, depth_radii=mujoco.DEPTH_RADII)
        text = mark + mujoco.text_of(subject, numbers, tuned.chosen)
    elif tuned.simulator in _SCRIPTED:
        text = scripts.text_of(subject, _SCRIPTED[tuned.simulator], numbers, tuned.chosen)
        text = f"# Palpate tuned settings: {moved}\n{text}"
    else:
        text = _named(tuned, moved)
    with atomic_file(Path(path), SETTINGS) as temporary:
        temporary.write_text(text, encoding="utf-8")
    return Path(path)


def _named(tuned: Tuned, moved: str) -> str:
    """Settings by name, for a simulator whose scene is the user's own script."""
    material = tuned.model.material
    rows = [f"    {json.dumps(name)}: {float(value)!r}," for name, value in tuned.settings.items()]
    given = f"young_modulus_pa={material.young_modulus_pa!r}, poisson_ratio={material.poisson_ratio!r}"
    return "\n".join([
        f"# Palpate tuned settings: {moved}",
        f"# physics held: {given}, tip_radius_m={tuned.model.tool.tip_radius_m!r}",
        "# order: of the elements, ElementTetP1 or ElementTetP2; penalty: spring of the contact, over the",
        "# stiffness of the object under one node; edge_radii: edges under the tip, in its radii",
        "from math import inf",
        "",
        "SETTINGS = {",
        *rows,
        "}",
        "",
    ])  # fmt: skip
