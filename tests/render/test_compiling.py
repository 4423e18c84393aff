"""Each kernel of the renderer and of the tick is compiled for one kind of arguments, and once a machine."""

import json
import os
import subprocess
import sys
from pathlib import Path

import mechanics

ROOT = Path(mechanics.__file__).parents[1]

COMPILING = """
import json
import numpy as np
from numba.core import event

found = []

class Watch(event.Listener):
    def on_start(self, event):
        function = event.data["dispatcher"].py_func
        found.append(f"{function.__module__}.{function.__qualname__}")

    def on_end(self, event):
        pass

event.register("numba:compile", Watch())

import palpate.warm_up
from render.press import Stroke, press

renderer = palpate.warm_up.block_renderer()
for work in palpate.warm_up.stages(renderer).values():
    work()
press(renderer, [0.0, 0.0, 0.012], [0.0, 0.0, -1.0], Stroke(1e-3, 0.05))
tips = np.array([[0.0, 0.0, 0.05]])
tips.setflags(write=False)
renderer.step(renderer.start(), tips)
renderer.step(renderer.start(radii_m=[0.005, 0.005]), np.zeros((3, 2)).T)
print(json.dumps(found))
"""


def compiled(cache: Path) -> list[str]:
    """What a process of its own compiles for steps, a press, a replay and a tick, with numba's cache here."""
    # with LLVM's optimisation: without it names of pointers stay behind, and numba keeps no such kernel
    environment = {**os.environ, "PYTHONPATH": str(ROOT), "NUMBA_CACHE_DIR": str(cache)}
    done = subprocess.run(
        [sys.executable, "-P", "-c", COMPILING], env=environment, capture_output=True, text=True
    )
    assert done.returncode == 0, done.stderr
    found: list[str] = json.loads(done.stdout.splitlines()[-1])
    return found


def test_a_kernel_is_compiled_once_and_found_by_the_next_process(tmp_path):
    first = compiled(tmp_path)
    own = [name for name in first if not name.startswith("numba.") and "<locals>" not in name]
    assert {"render.fem_kernel.fem_step", "render.base._follow", "palpate.servo.loop.compiled_loop"} <= set(
        own
    )
    assert sorted(own) == sorted(set(own))
    assert compiled(tmp_path) == []
