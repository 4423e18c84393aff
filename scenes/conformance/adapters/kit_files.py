"""The kit's files for an adapter, and its forces: python run_NAME.py FORCES_DIR [--only CASE ...]."""

import argparse
import json
import time
from pathlib import Path

import numpy as np

KIT = Path(__file__).resolve().parent.parent


def run(press, words=None):
    """Write NAME.csv (t,fx,fy,fz) of every tip. press(body, physics, t, centres) -> (n, tips, 3) N on the
    tips; body: arrays points (n, 3) m, tetrahedra (m, 4), fixed (f,); physics: numbers of kit.json by name;
    t (n,) s; centres (n, tips, 3) m."""
    kit = json.loads((KIT / "kit.json").read_text())
    names = [case["name"] for case in kit["cases"]]
    parser = argparse.ArgumentParser()
    parser.add_argument("forces", type=Path)
    parser.add_argument("--only", nargs="+", choices=names, default=names)
    arguments = parser.parse_args(words)
    arguments.forces.mkdir(parents=True, exist_ok=True)
    for case in kit["cases"]:
        if case["name"] not in arguments.only:
            continue
        with np.load(KIT / "bodies" / f"{case['body']}.npz") as stored:
            body = {key: stored[key] for key in stored.files}
        paths = [np.loadtxt(KIT / "paths" / f"{tip}.csv", delimiter=",", skiprows=1) for tip in case["tips"]]
        centres, began = np.stack([path[:, 1:] for path in paths], axis=1), time.process_time()
        force = press(body, kit["physics"], paths[0][:, 0], centres)
        print(f"{case['name']}: {time.process_time() - began:.1f} CPU s", flush=True)
        for k, tip in enumerate(case["tips"]):
            rows = np.column_stack([paths[0][:, 0], force[:, k]])
            out = arguments.forces / f"{tip}.csv"
            np.savetxt(out, rows, fmt="%.7g", delimiter=",", header="t,fx,fy,fz", comments="")


def stepped(t, centres, step_s, advance):
    """(n, tips, 3) N at the path's times: advance(centres (tips, 3) m, velocity (tips, 3) m/s) makes one
    step of step_s, at whose end the tips are there, and returns (tips, 3) N."""
    force, at, now = np.zeros(centres.shape), centres[0], 0
    for k in range(1, len(t)):
        until = round((t[k] - t[0]) / step_s)
        way = (centres[k] - at) / max(until - now, 1)
        for _ in range(until - now):
            at = at + way
            force[k] = advance(at, way / step_s)
        if until == now:
            force[k] = force[k - 1]
        now = until
    return force
