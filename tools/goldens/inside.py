"""Run by the interpreter that is measured, `python -P inside.py WHAT ...`: it imports palpate and NumPy
alone."""

from __future__ import annotations

import contextlib
import dataclasses
import hashlib
import inspect
import io
import json
import runpy
import sys
from pathlib import Path
from typing import Any

import numpy as np

RATE = '[recording]\nsample_rate_hz = 1000.0\nforce_on = "tool"\n'
RADIUS = "[tool]\ntip_radius_m = 0.005\n"


def facts() -> dict[str, str]:
    """The version."""
    import palpate as pp

    return {"version": pp.__version__}


def shipped() -> str:
    """The folder of the model that is shipped, in the cache."""
    import palpate as pp

    return str(pp.load("demo", progress=False).path)


def commands(path: str) -> list[dict[str, Any]]:
    """Command lines of a JSON file, one after another in this process."""
    out = []
    for words in json.loads(Path(path).read_text(encoding="utf-8")):
        said, errors, code = io.StringIO(), io.StringIO(), 0
        sys.argv = ["palpate", *words]
        with contextlib.redirect_stdout(said), contextlib.redirect_stderr(errors):
            try:
                runpy.run_module("palpate", run_name="__main__", alter_sys=True)
            except SystemExit as end:
                code = end.code if isinstance(end.code, int) else int(end.code is not None)
        out.append({"exit": code, "stdout": said.getvalue(), "stderr": errors.getvalue()})
    return out


def signatures() -> dict[str, Any]:
    """Every name of `pp`: parameters of functions, fields and methods of types."""
    import palpate as pp

    return {name: _described(name, getattr(pp, name), pp) for name in dir(pp) if name != "__version__"}


def _described(name: str, what: Any, pp: Any) -> dict[str, Any]:
    if not inspect.isclass(what):
        try:
            known = {o.name: o for o in pp.options(name)}
        except pp.OptionError:
            known = {}
        taken = inspect.signature(what).parameters.values()
        words = (inspect.getdoc(what) or "").splitlines()
        return {"parameters": [_parameter(p, known) for p in taken], "words": words}
    fields = dataclasses.fields(what) if dataclasses.is_dataclass(what) else ()
    public = [n for n in dir(what) if not n.startswith("_") and n not in dir(Exception)]
    return {
        "caught as": [base.__name__ for base in what.__mro__ if issubclass(base, BaseException)],
        "fields": [f"{f.name} = {_default(f)}" for f in fields],
        "attributes": [n for n in public if not callable(getattr(what, n))],
        "methods": {n: _names(getattr(what, n)) for n in public if callable(getattr(what, n))},
    }


def _parameter(each: inspect.Parameter, known: dict[str, Any]) -> dict[str, Any]:
    empty = each.default is inspect.Parameter.empty
    said = {"name": each.name, "kind": each.kind.name, "default": "none" if empty else repr(each.default)}
    option = known.get(each.name)
    if option is not None:
        said |= {"unit": option.unit, "choices": repr(option.choices)}
        said |= {"range": repr((getattr(option, "low", None), getattr(option, "high", None)))}
    return said


def _default(field: dataclasses.Field[Any]) -> str:
    if field.default is not dataclasses.MISSING:
        return repr(field.default).split(" at 0x")[0]
    return "none" if field.default_factory is dataclasses.MISSING else "made"


def _names(method: Any) -> str:
    try:
        return ", ".join(
            p.name if p.default is p.empty else f"{p.name}={p.default!r}".split(" at 0x")[0]
            for p in inspect.signature(method).parameters.values()
        )
    except ValueError:
        return "?"


def ticks(model: str) -> dict[str, Any]:
    """Renderers stepped along a scripted path: numbers, and hashes of their bytes."""
    import palpate as pp

    made = pp.load(model, progress=False)
    path = _scripted(made)
    nodule = pp.load("nodule", progress=False)
    top = np.array([0.0, 0.0, nodule.mesh.points[:, 2].max()])
    over = _way(
        [(top + [x, 0.4 * x, z]) for x, z in ((-0.01, 0.008), (0.0, 0.001), (0.015, 0.0), (0.02, 0.01))]
    )
    fem = pp.renderer(made, progress=False)
    cases = {name: (pp.renderer(made, name, progress=False), path) for name in (
        "kelvin-voigt", "hunt-crossley", "hunt-crossley-undamped", "hunt-crossley-kh")}  # fmt: skip
    cases |= {
        "fem": (fem, path),
        "fem, linear dent": (pp.renderer(made, dent_law="linear", progress=False), path),
        "fem, friction 0.2": (fem.with_friction(0.2), path),
        "fem, friction 0": (fem.with_friction(0.0), path),
        "fem, behind a spring": (fem.with_series_compliance(5e-4), path),
        "fem, 10 kPa": (fem.with_modulus(10e3), path),
        "inclusion": (pp.renderer(nodule, progress=False), over),
    }
    out = {name: _stepped(renderer, [way]) for name, (renderer, way) in cases.items()}
    other = path[::-1].copy()
    out["fem, two tips"] = _stepped(fem, [path, other], radii_m=[0.005, 0.003])
    out["fem, 2 ms"] = _stepped(fem, [path], dt_s=2e-3)
    return out


def _way(points: list[np.ndarray], steps: int = 400) -> np.ndarray:
    """(n, 3) m through points, straight, `steps` ticks from each to the next."""
    at = np.arange(len(points)) * steps
    t = np.arange(at[-1] + 1)
    return np.column_stack([np.interp(t, at, [p[k] for p in points]) for k in range(3)])


def _scripted(model: Any) -> np.ndarray:
    """Presses of the model's own recording, pressed, dragged and left; once with a reading that is no
    number."""
    radius, presses = model.tool.tip_radius_m, model.presses
    points: list[np.ndarray] = []
    for k in (0, 2, 7, 20):
        place, normal = presses.point[k], presses.normal[k]
        side = np.cross(normal, [0.3, 0.5, 0.8])
        for depth, aside in ((-0.02, 0.0), (0.004, 0.0), (0.003, 0.006), (0.001, -0.004), (-0.02, 0.0)):
            points.append(place + (radius - depth) * normal + aside * side)
    path = _way(points, 150)
    path[1000] = np.nan
    return path


def _stepped(renderer: Any, ways: list[np.ndarray], **start: Any) -> dict[str, Any]:
    length = min(map(len, ways))
    tips = np.stack([way[:length] for way in ways], axis=1)
    state = renderer.start(radii_m=[0.005] * len(ways)) if not start else renderer.start(**start)
    forces = np.empty_like(tips)
    for k, each in enumerate(tips):
        state, force = renderer.step(state, each)
        forces[k] = force
    return _numbers(forces)


def _numbers(values: np.ndarray) -> dict[str, Any]:
    values = np.ascontiguousarray(values, float)
    every = max(len(values) // 40, 1)
    return {
        "shape": list(values.shape),
        "rms": float(np.sqrt(np.nanmean(values**2))),
        "samples": values[::every].reshape(-1).tolist(),
        "bits": hashlib.sha256(values.tobytes()).hexdigest(),
    }


def wrong(folder: str) -> None:
    """Files that hold nothing of use."""
    to = Path(folder)
    to.mkdir(parents=True, exist_ok=True)
    (to / "nothing.csv").write_text("a,b\n1,2\n")
    (to / "broken.toml").write_text("[recording\n")
    (to / "broken.csv").write_text("t,x,y,z,fx,fy,fz\n0,0,0,0,0,0,0\n")
    (to / "still.csv").write_text("t,fx,fy,fz\n0,0,0,0\n1,0,0,0\n")


def inputs(folder: str) -> None:
    """Files that stand for other people's: a table of a robot, a simulator's forces, a machine's curves, a
    plate that was pressed, a box, and recordings that are not right."""
    import palpate as pp

    to = Path(folder)
    recording = pp.read_recording("silicone-1-cylinder")
    t, x, f = recording.t, recording.position, recording.force_on_tool
    part = slice(15000, 45000, 2)
    robot = np.column_stack([t[part] * 1e3, x[part] * 1e3, -f[part]])
    _table(to / "robot.csv", "time_ms,tcp_x_mm,tcp_y_mm,tcp_z_mm,Fx_N,Fy_N,Fz_N", robot, "%.6g")
    replayed = np.asarray(pp.replay("demo", recording, progress=False).force_n)
    _table(to / "forces.csv", "t,fx,fy,fz", np.column_stack([t, 0.7 * replayed]), "%.9g")
    cut = slice(0, 30000)
    _table(to / "short.csv", "t,x,y,z,fx,fy,fz", np.column_stack([t[cut], x[cut], f[cut]]), "%.5f")
    (to / "short.toml").write_text(RATE + RADIUS)
    _table(to / "mixed.csv", "t,x,y,z,fx,fy,fz", np.column_stack([t, 1e3 * x, f]), "%.4f")
    (to / "mixed.toml").write_text(RATE + RADIUS)
    for k, speed in enumerate((1e-3, 3e-3, 1e-2) * 3):
        _table(to / f"curve{k}.csv", "time (s),indentation (um),load (mN)", _curve(k, speed), "%.5f")
    _table(to / "plate.csv", "t,x,y,z,fx,fy,fz", _plate(), "%.7f")
    (to / "plate.toml").write_text(RATE + RADIUS + "[sensor]\nforce_noise_std_n = 0.01\n")
    (to / "box.stl").write_text(_box(0.06, 0.05, 0.04))


def _table(path: Path, header: str, rows: np.ndarray, form: str) -> None:
    np.savetxt(path, rows, delimiter=",", header=header, comments="", fmt=form)


def _curve(seed: int, speed: float) -> np.ndarray:
    """A sphere of 5 mm into 20 kPa that relaxes by 0.3 in 0.3 s, at `speed` m/s: s, um, mN."""
    rng = np.random.default_rng(seed)
    t = np.arange(0, 0.3 + 2e-3 / speed + 0.5, 2e-3 if speed > 5e-3 else 5e-3)
    depth = speed * np.clip(t - 0.3, 0, 2e-3 / speed)
    elastic = 4 / 3 * 20e3 / (1 - 0.49**2) * np.sqrt(5e-3) * depth**1.5
    memory, force = 0.0, np.zeros_like(t)
    for k in range(1, len(t)):
        share = np.exp(-(t[k] - t[k - 1]) / 0.3)
        memory = share * memory + 0.3 * (elastic[k] - elastic[k - 1])
        force[k] = elastic[k] + memory
    load = 1e3 * force + rng.normal(0, 0.05, len(t))
    return np.column_stack([t, 1e6 * (depth + speed * np.minimum(t - 0.3, 0)), load])


def _plate() -> np.ndarray:
    """Presses on a rigid plate by a tool of 5000 N/m whose force reads 10 ms late; t, x, y, z, fx, fy, fz."""
    rng = np.random.default_rng(5)
    t, x, f, now = [], [], [], 0.0
    for k in range(24):
        deepest, speed = 4e-4 + 1e-4 * (k % 5), (2e-3, 5e-3, 1e-2)[k % 3]
        ramp = deepest / speed
        local = np.arange(0, 0.8 + 2 * ramp + 0.5, 1e-3)
        into = np.interp(local, [0, 0.4, 0.4 + ramp, 0.7 + ramp, 0.7 + 2 * ramp, 1.3 + 2 * ramp],
                         [-0.004, 0, deepest, deepest, 0, -0.004])  # fmt: skip
        place = 0.03 * np.array([np.cos(2.4 * k), np.sin(2.4 * k)]) * np.sqrt((k + 1) / 24)
        x.append(np.column_stack([np.tile(place, (len(local), 1)), 5e-3 - into]))
        late = np.interp(local - 0.01, local, np.maximum(into, 0))
        f.append(np.column_stack([np.zeros((len(local), 2)), 5000 * late]))
        t.append(now + local)
        now = t[-1][-1] + 1e-3
    force = np.concatenate(f)
    noise = rng.normal(0, 0.01, force.shape)
    return np.column_stack([np.concatenate(t), np.concatenate(x), force + noise])


def _box(a: float, b: float, c: float) -> str:
    corner = np.array([[i, j, k] for i in (0, 1) for j in (0, 1) for k in (0, 1)], float) * [a, b, c]
    faces = [(0, 1, 3), (0, 3, 2), (4, 6, 7), (4, 7, 5), (0, 4, 5), (0, 5, 1), (2, 3, 7), (2, 7, 6),
             (0, 2, 6), (0, 6, 4), (1, 5, 7), (1, 7, 3)]  # fmt: skip
    lines = ["solid box"]
    for face in faces:
        lines += ["facet normal 0 0 0", "outer loop"]
        lines += ["vertex {:.6f} {:.6f} {:.6f}".format(*corner[k]) for k in face]
        lines += ["endloop", "endfacet"]
    return "\n".join([*lines, "endsolid box", ""])


if __name__ == "__main__":
    what, *rest = sys.argv[1:]
    answer = {f.__name__: f for f in (facts, shipped, commands, signatures, ticks, wrong, inputs)}[what](
        *rest
    )
    print(json.dumps(answer))
