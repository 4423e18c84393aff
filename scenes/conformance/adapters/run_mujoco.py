"""MuJoCo: a flex of the kit's tetrahedra on its pinned base, and heavy spheres on slides.

A sphere is put to its place with its velocity at every step: to friction a mocap body stands still.
"""

import sys

import mujoco
import numpy as np
from kit_files import run, stepped

STEP_S, SKIN_M, HEAVY_KG = 1e-3, 1e-5, 1e3
NODE_KG = 2e-6  # a flex shares its mass evenly: so much has a median node at 1000 kg/m^3; heavier, it rings
CONTACT = 'solref="0.004 1" solimp="0.99 0.999 0.001" condim="3"'


def scene(body, physics, starts):
    """The compiled model; the spheres' centres are the first of qpos, away from their starts."""
    points, tetrahedra = body["points"], body["tetrahedra"].astype(int)
    contact = f'{CONTACT} friction="{physics["friction"]}"'
    radius = physics["tip_radius_m"] - SKIN_M
    slides = "".join(f'<joint type="slide" axis="{axis}"/>' for axis in ("1 0 0", "0 1 0", "0 0 1"))
    tips = "".join(
        f'<body pos="{x} {y} {z}">{slides}'
        f'<geom name="tip{k}" type="sphere" size="{radius}" mass="{HEAVY_KG}" {contact}'
        ' contype="1" conaffinity="2"/></body>'
        for k, (x, y, z) in enumerate(starts)
    )
    flat = {"p": " ".join(f"{v:.7g}" for v in points.ravel()), "e": " ".join(map(str, tetrahedra.ravel()))}
    spec = mujoco.MjSpec.from_string(f"""<mujoco>
<option timestep="{STEP_S}" gravity="0 0 0" integrator="discrete" solver="CG" cone="elliptic" impratio="10"/>
<size memory="2G"/>
<worldbody>{tips}
<flexcomp name="body" type="direct" dim="3" mass="{NODE_KG * len(points)}" radius="{SKIN_M}"
 point="{flat["p"]}" element="{flat["e"]}">
<contact selfcollide="none" {contact} contype="2" conaffinity="1"/>
<elasticity young="{physics["young_modulus_pa"]}" poisson="{physics["poisson_ratio"]}" damping="0.002"/>
<pin id="{" ".join(map(str, body["fixed"]))}"/></flexcomp></worldbody></mujoco>""")
    for flex in spec.flexes:
        flex.elastic3d = 1  # stable neo-Hookean
    return spec.compile()


def press(body, physics, t, centres):
    """(n, tips, 3) N."""
    starts = centres[0]
    model = scene(body, physics, starts)
    data, wrench, count = mujoco.MjData(model), np.zeros(6), len(starts)
    geoms = [model.geom(f"tip{k}").id for k in range(count)]

    def advance(at, velocity):
        data.qpos[: 3 * count] = (at - velocity * STEP_S - starts).ravel()
        data.qvel[: 3 * count] = velocity.ravel()
        mujoco.mj_step(model, data)
        total = np.zeros((count, 3))
        for c in range(data.ncon):
            contact = data.contact[c]
            mujoco.mj_contactForce(model, data, c, wrench)
            # a contact's force acts on the second of the two, along the frame's first axis
            first = contact.geom[0] in geoms
            tip = geoms.index(contact.geom[0] if first else contact.geom[1])
            total[tip] += (-1.0 if first else 1.0) * (np.asarray(contact.frame).reshape(3, 3).T @ wrench[:3])
        return total

    return stepped(t, centres, STEP_S, advance)


if __name__ == "__main__":
    sys.exit(run(press))
