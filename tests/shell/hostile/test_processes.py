"""No child outlives its parent, an interrupt leaves no traceback, and nothing foreign is unpickled."""

from __future__ import annotations

import signal
import subprocess
import sys
from pathlib import Path

import pytest

from palpate.mechanics.kernel_cache import sources

from ...support.waiting import PATIENCE_S, eventually


def test_a_process_that_follows_its_parent_ends_with_it():
    code = "import time; from palpate.child import end_with_parent; end_with_parent(); time.sleep(600)"
    child = subprocess.Popen([sys.executable, "-c", code], stdin=subprocess.PIPE)
    child.stdin.close()
    assert child.wait(PATIENCE_S) == 1


@pytest.mark.skipif(sys.platform != "linux", reason="elsewhere it ends by itself, after its time")
def test_the_mesher_ends_when_its_parent_is_killed(tmp_path):
    """One that would mesh for an hour, as fTetWild does on some surfaces."""
    from palpate.reconstruction.steps.s5_mesh import tetwild

    (tmp_path / "pytetwild.py").write_text("import time; open('begun', 'w'); time.sleep(3600)")
    words = f"[sys.executable, '-c', {tetwild._CHILD!r}, str(os.getpid()), '60']"
    code = f"import os, subprocess, sys; subprocess.run({words})"
    parent = subprocess.Popen([sys.executable, "-S", "-c", code], cwd=tmp_path)
    begun = tmp_path / "begun"
    assert eventually(begun.exists)
    [child] = Path(f"/proc/{parent.pid}/task/{parent.pid}/children").read_text().split()
    parent.kill()
    parent.wait()
    assert eventually(lambda: not Path(f"/proc/{child}/cmdline").exists())


def test_a_worker_of_the_laboratory_ends_when_its_parent_is_killed(tmp_path):
    code = (
        "import os, signal\n"
        "from palpate.scenes.laboratory.curves import workers_of_ours\n"
        "if __name__ == '__main__':\n"
        "    with workers_of_ours(1) as pool:\n"
        "        print(pool.submit(os.getpid).result(), flush=True)\n"
        "        os.kill(os.getpid(), signal.SIGKILL)\n"
    )
    path = tmp_path / "main.py"
    path.write_text(code)
    # its pipes close, and this returns, when the last process that holds them is gone
    done = subprocess.run([sys.executable, path], capture_output=True, text=True, timeout=PATIENCE_S)
    assert done.returncode == -signal.SIGKILL and int(done.stdout) > 0


def test_an_interrupt_while_loading_leaves_without_a_traceback(tmp_path):
    code = (
        "import os, signal, sys, threading; import palpate.cli\n"
        "signal.signal(signal.SIGINT, signal.default_int_handler)\n"  # a shell's background job ignores it
        "threading.Timer(0.15, os.kill, (os.getpid(), signal.SIGINT)).start()\n"
        "sys.exit(palpate.cli.main(['touch', '--headless']))"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, timeout=PATIENCE_S)
    assert done.returncode == 130 and "Traceback" not in done.stderr, done.stderr
    assert "interrupted" in done.stderr


def test_nothing_unpickles_what_a_stranger_may_have_written():
    for name, path in sources().items():
        text = Path(path).read_text(encoding="utf-8")
        assert "allow_pickle=True" not in text, name
        # the servo and the workers of a batch read what their own parent sends through a pipe
        if "pickle.load" in text:
            assert name.startswith(("palpate.servo.", "palpate.parallel.")), name
