"""MuJoCo's flex on the same mesh beside the FEM renderer: time of a step, and force against a fine solution.

The block of the servo benchmark as linear tetrahedra (what flex takes), its base pinned, pressed in
the middle of its top by a rigid sphere of 5 mm to 1, 2 and 3 mm. Hertz' force for a half space stands beside
both; the block is finite, so the FEM renderer on its quadratic mesh is not expected to meet it exactly.
"""

from __future__ import annotations

import contextlib
import tempfile
import time
from typing import Any

import numpy as np

from benchmarks._servo_load import TIP_RADIUS_M, block_model, renderer_of
from benchmarks.compliance import block
from benchmarks.timing import table
from mechanics.tetmesh import TetMesh

YOUNG_PA, POISSON = 30e3, 0.49
DEPTHS_M = (0.001, 0.002, 0.003)
SETTLE_S, TIMED_STEPS, OUR_STEPS = 0.3, 50, 2000


def hertz_n(depth_m: float) -> float:
    """Hertz' force of the tip in a half space, N."""
    return 4.0 / 3.0 * YOUNG_PA / (1 - POISSON**2) * np.sqrt(TIP_RADIUS_M) * depth_m**1.5


def flex_xml(
    mesh: TetMesh,
    timestep_s: float,
    *,
    young_pa: float = YOUNG_PA,
    poisson: float = POISSON,
    radius_m: float = TIP_RADIUS_M,
) -> str:
    """An object as a flex with a mocap sphere above its top."""
    points = " ".join(f"{value:.6g}" for value in mesh.points.ravel())
    elements = " ".join(str(node) for node in mesh.tetrahedra.ravel())
    pins = " ".join(str(node) for node in np.flatnonzero(mesh.fixed))
    mass = 1000.0 * float(mesh.volumes.sum())
    top = mesh.points.max(axis=0)
    middle = 0.5 * (top + mesh.points.min(axis=0))
    return f"""<mujoco>
<option timestep="{timestep_s}" gravity="0 0 0" integrator="discrete" solver="CG"/>
<size memory="1G"/>
<worldbody>
<body name="tip" mocap="true" pos="{middle[0]} {middle[1]} {top[2] + radius_m + 0.001}">
<geom name="tip" type="sphere" size="{radius_m}" condim="3" friction="0.5"/></body>
<flexcomp name="block" type="direct" dim="3" mass="{mass}" radius="1e-4"
 point="{points}" element="{elements}">
<contact condim="3" selfcollide="none" friction="0.5"/>
<elasticity young="{young_pa}" poisson="{poisson}" damping="0.01"/>
<pin id="{pins}"/>
</flexcomp></worldbody></mujoco>"""


def flex_forces(touchable: int, timestep_s: float) -> dict[str, Any]:
    """Step time and settled force of the flex at each depth."""
    import mujoco

    mesh = block(touchable, 1)
    model = mujoco.MjModel.from_xml_string(flex_xml(mesh, timestep_s))
    data = mujoco.MjData(model)
    top = float(mesh.points[:, 2].max())
    forces, steps = [], []
    wrench = np.zeros(6)
    start = data.mocap_pos[0].copy()
    for depth in DEPTHS_M:
        target = top + TIP_RADIUS_M - depth
        count = round(SETTLE_S / timestep_s)
        for k in range(count):
            data.mocap_pos[0, 2] = start[2] + (target - start[2]) * min(1.0, 2.0 * k / count)
            mujoco.mj_step(model, data)
        start = data.mocap_pos[0].copy()
        began = time.process_time()
        for _ in range(TIMED_STEPS):
            mujoco.mj_step(model, data)
        steps.append((time.process_time() - began) / TIMED_STEPS)
        total = np.zeros(3)
        for c in range(data.ncon):
            mujoco.mj_contactForce(model, data, c, wrench)
            total += data.contact[c].frame.reshape(3, 3).T @ wrench[:3]
        forces.append(float(np.linalg.norm(total)))
    return {"nodes": len(mesh.points), "forces_n": forces, "step_s": float(np.median(steps))}


def ours(touchable: int) -> dict[str, Any]:
    """The same presses through the FEM renderer on the block's quadratic mesh."""
    renderer, _ = renderer_of(touchable)
    mesh = block_model(touchable).mesh
    top = mesh.points.max(axis=0)
    middle = 0.5 * (top + mesh.points.min(axis=0))
    forces = []
    for depth in DEPTHS_M:
        state = renderer.start()
        for part in np.linspace(-0.001, depth, 50):
            tip = np.array([[middle[0], middle[1], top[2] + TIP_RADIUS_M - part]])
            state, force = renderer.step(state, tip)
        forces.append(float(np.linalg.norm(force[0])))
    slide = tip + 1e-6 * np.arange(OUR_STEPS)[:, None, None] * [1.0, 0.0, 0.0]
    renderer.follow(state, slide[:1], np.full(1, 1e-3))
    began = time.process_time()
    renderer.follow(state, slide, np.full(OUR_STEPS, 1e-3))
    return {
        "nodes": len(mesh.points),
        "forces_n": forces,
        "step_s": (time.process_time() - began) / OUR_STEPS,
    }


def compare(touchable: int = 300, timestep_s: float = 0.001) -> dict[str, Any]:
    """Both, and Hertz; MuJoCo is optional: where it is not installed, says so."""
    result: dict[str, Any] = {"depths_m": DEPTHS_M, "hertz_n": [hertz_n(d) for d in DEPTHS_M]}
    result["fem"] = ours(touchable)
    try:
        # MuJoCo leaves its warnings in a file where it runs
        with tempfile.TemporaryDirectory() as folder, contextlib.chdir(folder):
            result["mujoco_flex"] = flex_forces(touchable, timestep_s)
    except ImportError:
        print("MuJoCo is not installed (pip install mujoco): no peer beside")
    except Exception as error:  # a peer's failure is a finding, not ours to hide or to die of
        result["mujoco_flex_failed"] = str(error)
        print(f"MuJoCo's flex did not run on this mesh: {error}")
    rows = []
    for name in ("fem", "mujoco_flex"):
        if name in result:
            seen = result[name]
            rows.append(
                [name, seen["nodes"], 1e6 * seen["step_s"]]
                + [
                    f"{f:.3g} ({f / h - 1:+.0%})"
                    for f, h in zip(seen["forces_n"], result["hertz_n"], strict=True)
                ]
            )
    header = ["model", "nodes", "step, CPU us", *(f"N at {1000 * d:g} mm (against Hertz)" for d in DEPTHS_M)]
    print(table(header, rows))
    return result
