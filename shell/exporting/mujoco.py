"""MuJoCo: the scene of `palpate replay --renderer mujoco --simulator-settings best`, as far as a file can say
it (`FILE_SETTINGS`), with a drive of its tip.

Three position actuators lead the heavy sphere on its slides: a mocap body has no velocity, and drags nothing
along. A flex has one modulus and linear tetrahedra, which lock near nu = 0.5.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np

from palpate.exporting.subject import Subject
from palpate.mechanics.progress import silent
from palpate.render.options import BEST
from palpate.render.registry import create
from palpate.render.replay import replay
from palpate.render.simulators.mujoco import MuJoCo, force_on_tip, scene_xml
from palpate.show.colours import COLOURS
from palpate.show.scenery import AZIMUTH_DEG, ELEVATION_DEG, view_axes
from palpate.words import mm, mn

FILE_SETTINGS = "material=1,skin_m=1e-4"
"""A file's flex is a Saint Venant-Kirchhoff solid, which gives way where it is crushed; its radius, by which
the surface stands off, makes up for that in a shallow press."""
DEPTH_RADII = 1 / 6
"""Depth of a press that nobody said, in radii of the tip: a flex of a file softens under a deeper one."""
DEEP_RADII = 0.5
"""Depth of the press that shows how much, in radii of the tip."""
_SETTLED, _READ = 200, 50
"""Steps of 1 ms until a tip that is led there stands, and those of them that are read."""
DRIVE_N_PER_M = 1e7
"""Of the tip: a newton moves it by a tenth of a micrometre, and it follows what it is led to by 20 ms."""


def _row(values: np.ndarray) -> str:
    return " ".join(f"{value:.9g}" for value in values)


def _rgba(thing: str) -> str:
    return _row((np.array([*bytes.fromhex(COLOURS[thing][1:]), 255]) / 255).round(3))


def text_of(subject: Subject, numbers: str = FILE_SETTINGS, settings: str = BEST) -> str:
    """The MJCF scene; `ctrl` of its three actuators leads the tip's centre away from its start, in metres."""
    run = subject.as_run(MuJoCo, numbers, settings)
    mesh = run.mesh_under(subject.near, subject.radius_m)
    low, high = mesh.points.min(axis=0), mesh.points.max(axis=0)
    middle, span, across = (low + high) / 2, float((high - low).max()), float(np.linalg.norm(high - low))
    drive = f'kp="{DRIVE_N_PER_M:g}" dampratio="1" ctrlrange="-{span:.6g} {span:.6g}"'
    drives = "\n".join(f'<position name="tip_{axis}" joint="tip_{axis}" {drive}/>' for axis in "xyz")
    up = subject.model.support.normal
    ahead = -view_axes(up, ELEVATION_DEG, AZIMUTH_DEG)[2]
    azimuth, elevation = np.degrees([np.arctan2(ahead[1], ahead[0]), np.arcsin(ahead[2])])
    # the viewer begins at 1.5 extents from the centre
    beside = f"""<statistic center="{_row(middle)}" extent="{across:.6g}"/>
<visual><global azimuth="{azimuth:.4g}" elevation="{elevation:.4g}" offwidth="1280" offheight="960"/>
<headlight ambient="0.4 0.4 0.4" diffuse="0.4 0.4 0.4" specular="0 0 0"/></visual>
<custom><text name="pressed" data="{_row(subject.pressed)}"/></custom>
<worldbody><light pos="{_row(middle + 3 * span * up)}" diffuse="0.4 0.4 0.4"/></worldbody>
<actuator>
{drives}
</actuator>
"""
    scene = scene_xml(
        mesh, subject.radius_m, run.stated, run.own, start=subject.near, beside=beside,
        colours=(_rgba("object"), _rgba("tip")),
    )  # fmt: skip
    return f"<!-- {subject.label} -->\n{scene}"


def write(path: Path, subject: Subject) -> tuple[str, ...]:
    """Write the scene; what it cannot say."""
    path.write_text(text_of(subject), encoding="utf-8")
    move = ", ".join(f"{round(float(value), 7) + 0.0:g}" for value in subject.pressed - subject.near)
    return (
        f"the tip waits above the object: `data.ctrl[:] = [{move}]` presses it in, within some 20 ms",
        *subject.run_notes(MuJoCo, FILE_SETTINGS),
        f"a flex softens under a deep dent{_softened(path, subject)}: compare presses of a sixth of the "
        "tip's radius, or set elastic3d of its MjSpec to 1 (stable neo-Hookean), which no file can say",
    )


def _softened(path: Path, subject: Subject) -> str:
    """What the file and the model give at a deeper press, in words; '' where MuJoCo is not installed."""
    try:
        import mujoco
    except ImportError:
        return ""
    height = float(subject.model.support.height(subject.top[None])[0])
    depth_m = min(DEEP_RADII * subject.radius_m, 0.5 * height)
    deep = subject.top + (subject.radius_m - depth_m) * subject.normal
    scene = mujoco.MjModel.from_xml_path(str(path))
    data, felt = mujoco.MjData(scene), []
    for _ in range(_SETTLED):
        data.ctrl[:] = deep - subject.near
        mujoco.mj_step(scene, data)
        felt.append(float(force_on_tip(mujoco, scene, data) @ subject.normal))
    way = np.linspace(subject.near, deep, _SETTLED)
    own = replay(
        create("fem", subject.model, on_demand=True), 1e-3 * np.arange(_SETTLED), way, progress=silent
    )
    return (
        f" ({mm(depth_m)} deep this one reads {mn(float(np.mean(felt[-_READ:])))} here, the model "
        f"{mn(float(own[-1] @ subject.normal))})"
    )
