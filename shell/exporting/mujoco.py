"""MuJoCo: the object as a flex of linear tetrahedra on its base, and the tip as a heavy sphere on three
slides with a position actuator each: a mocap body has no velocity, and drags nothing along.

A flex has one modulus and linear tetrahedra, which lock near nu = 0.5. They are graded under the tip; under a
deep dent the flex, a Saint Venant-Kirchhoff solid, is softer than the model.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np

from palpate.exporting.subject import DENSITY_KG_M3, Subject

TIMESTEP_S = 1e-3
CONTACT = 'solref="0.004 1" solimp="0.999 0.999 0.001"'
"""As hard as the step allows."""
HEAVY_KG, DRIVE_N_PER_M = 100.0, 1e6
"""Of the tip: a newton moves it by a micrometre, and it follows what it is led to by 20 ms."""
EDGE_RADII = 1 / 3
"""Of the tip: a file's flex is a Saint Venant-Kirchhoff solid, which the finer the mesh gives the more way
where it is crushed; its radius, by which the surface stands off, makes up for that in a shallow press."""


def _row(values: np.ndarray) -> str:
    return " ".join(f"{value:.9g}" for value in values)


def text_of(subject: Subject) -> str:
    """The MJCF scene; `ctrl` of its three actuators leads the tip's centre away from its start, in metres."""
    mesh = subject.graded(EDGE_RADII)
    touch = f'condim="3" friction="{subject.friction:g}" {CONTACT}'
    middle, span = mesh.points.mean(axis=0), float(np.ptp(mesh.points, axis=0).max())
    pressed = " ".join(f"{value:.9g}" for value in subject.pressed)
    return f"""<!-- {subject.label} -->
<mujoco model="palpate">
<option timestep="{TIMESTEP_S:g}" gravity="0 0 0" integrator="discrete" solver="CG" cone="elliptic"/>
<size memory="1G"/>
<statistic center="{_row(middle)}" extent="{span:.6g}"/>
<custom><text name="pressed" data="{pressed}"/></custom>
<worldbody>
<light pos="{_row(middle + 3 * span * subject.model.support.normal)}"/>
<body name="tip" pos="{_row(subject.start)}">
{_SLIDES}
<geom name="tip" type="sphere" size="{subject.radius_m:.6g}" mass="{HEAVY_KG:g}" {touch}/></body>
<flexcomp name="object" type="direct" dim="3" mass="{DENSITY_KG_M3 * float(mesh.volumes.sum()):.6g}"
radius="1e-4"
 point="{_row(mesh.points.ravel())}"
 element="{" ".join(map(str, mesh.tetrahedra.ravel()))}">
<contact selfcollide="none" {touch}/>
<elasticity young="{subject.mean_modulus_pa:.6g}" poisson="{subject.model.material.poisson_ratio:.6g}"
 damping="0.01"/>
<pin id="{" ".join(map(str, np.flatnonzero(mesh.fixed)))}"/>
</flexcomp></worldbody>
<actuator>
{_drives(span)}
</actuator></mujoco>
"""


_SLIDES = "\n".join(
    f'<joint name="tip_{axis}" type="slide" axis="{_row(along)}"/>'
    for axis, along in zip("xyz", np.eye(3), strict=True)
)


def _drives(reach_m: float) -> str:
    drive = f'kp="{DRIVE_N_PER_M:g}" dampratio="1" ctrlrange="{-reach_m:.6g} {reach_m:.6g}"'
    return "\n".join(f'<position name="tip_{axis}" joint="tip_{axis}" {drive}/>' for axis in "xyz")


def write(path: Path, subject: Subject) -> tuple[str, ...]:
    """Write the scene; what it cannot say."""
    path.write_text(text_of(subject), encoding="utf-8")
    notes = [
        "linear tetrahedra, which come out stiffer than the model near nu = 0.5",
        "a flex softens under a deep dent: compare presses of a sixth of the tip's radius, or set elastic3d "
        "of its MjSpec to 1 (stable neo-Hookean), which no file can say",
        subject.friction_note,
    ]
    if np.ptp(subject.model.element_ratio) > 1e-9:
        notes.append("a flex has one modulus: the mean by volume")
    return tuple(notes)
