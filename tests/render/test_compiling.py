"""Each kernel of the renderer and of the tick is compiled for one kind of arguments, and once a machine."""

import json
import subprocess
import sys

import pytest

COMPILING = """
import gc
import json
import numpy as np
from numba.core import event
from numba.core.dispatcher import Dispatcher

found = []

class Watch(event.Listener):
    def on_start(self, event):
        function = event.data["dispatcher"].py_func
        found.append(f"{function.__module__}.{function.__qualname__}")

    def on_end(self, event):
        pass

event.register("numba:compile", Watch())

import palpate.warm_up
from palpate.render.press import Stroke, press

renderer = palpate.warm_up.block_renderer()
for work in palpate.warm_up.stages(renderer).values():
    work()
press(renderer, [0.0, 0.0, 0.012], [0.0, 0.0, -1.0], Stroke(1e-3, 0.05))
tips = np.array([[0.0, 0.0, 0.05]])
tips.setflags(write=False)
renderer.step(renderer.start(), tips)
renderer.step(renderer.start(radii_m=[0.005, 0.005]), np.zeros((3, 2)).T)

kinds = []
for one in gc.get_objects():
    if isinstance(one, Dispatcher) and not one.py_func.__module__.startswith("numba."):
        name = f"{one.py_func.__module__}.{one.py_func.__qualname__}"
        for arguments in one.signatures if "<locals>" not in name else ():
            records = [a.instance_class.__name__ for a in arguments if hasattr(a, "instance_class")]
            kinds.append([name, *records])
print(json.dumps([found, kinds]))
"""


def compiled() -> tuple[list[str], list[list[str]]]:
    """What a process of its own compiles for steps, a press, a replay and a tick; and each kind of arguments
    that one of our kernels then is compiled for: its name and the records among them, as a renderer's."""
    # the cache that all tests share: the first of two processes fills it where it lacks something
    done = subprocess.run([sys.executable, "-P", "-c", COMPILING], capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    found, kinds = json.loads(done.stdout.splitlines()[-1])
    return found, kinds


@pytest.mark.slow
def test_a_kernel_is_compiled_once_and_found_by_the_next_process():
    compiled()
    found, kinds = compiled()
    assert {
        "palpate.render.fem.kernel.fem_step",
        "palpate.render.base._follow",
        "palpate.servo.loop.compiled_loop",
    } <= {name for name, *_ in kinds}
    assert sorted(kinds) == sorted(map(list, {*map(tuple, kinds)}))
    assert found == []
