"""A servo process before it has anything to do: it loads, or compiles, what it will run meanwhile."""

from __future__ import annotations

import os
import subprocess
from collections.abc import Sequence
from contextlib import AbstractContextManager

from palpate.child import module_command
from palpate.servo.layout import SharedBlock


class StartedServo(AbstractContextManager["StartedServo"]):
    """The process and the block that it shares with this one; it waits for its job on its input.

    stages: of palpate.warm_up, which it does before that; a failure there costs only time. Use it in a `with`
    statement where it may never get one: what has no job is ended.
    """

    def __init__(self, stages: Sequence[str] = (), *, block: SharedBlock | None = None) -> None:
        self.block = block or SharedBlock()
        self.process = subprocess.Popen(
            module_command("palpate.servo", self.block.path, str(os.getpid()), *stages),
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            # a Ctrl-C at the terminal is the parent's to handle
            start_new_session=True,
        )
        self.taken = False

    def take(self) -> subprocess.Popen[bytes]:
        """The process, whose end is the caller's task from now on."""
        self.taken = True
        return self.process

    def __exit__(self, *error: object) -> None:
        if self.taken:
            return
        self.block.forget()
        self.process.kill()  # no device is open
        self.process.wait()
        for pipe in (self.process.stdin, self.process.stdout):
            if pipe is not None:
                pipe.close()
