"""A small machine under emulation: a stock kernel with uhid, this machine's files read-only, one command.

qemu without hardware acceleration, an initial file system made here, the host's root shared over 9p. The
command runs in a chroot into it, with the same Python as this test.
"""

from __future__ import annotations

import gzip
import os
import shlex
import subprocess
from pathlib import Path

MODULES = (
    *("virtio_ring", "virtio", "virtio_pci_modern_dev", "virtio_pci_legacy_dev", "virtio_pci"),
    *("netfs", "fscache", "9pnet", "9pnet_virtio", "9p", "hid", "uhid", "hid-generic"),
)
ENDED = "the command ended with"
INIT = """#!/bin/busybox sh
b=/bin/busybox
$b mkdir -p /proc /host
$b mount -t proc none /proc
$b echo 1 > /proc/sys/kernel/printk
# in any order that their dependencies allow
for turn in 1 2 3; do for m in /modules/*; do $b insmod $m 2>/dev/null; done; done
$b mount -t 9p -o trans=virtio,version=9p2000.L,msize=262144,cache=loose,ro host /host
$b mount -t devtmpfs none /host/dev
$b mount -t proc none /host/proc
$b mount -t sysfs none /host/sys
$b mount -t tmpfs none /host/tmp
$b chroot /host /bin/sh -c {command}
$b echo "{ended} $?"
$b poweroff -f
"""


class Missing(Exception):
    """What the machine is made of is not there."""


class Machine:
    """tools: a folder into which the packages of fetch.sh were unpacked, or '/' for what is installed."""

    def __init__(self, tools: Path) -> None:
        self.tools = tools
        self.qemu = self._one("usr/bin/qemu-system-x86_64")
        self.busybox = self._one("bin/busybox")
        self.kernel = self._one("boot/vmlinuz-*")
        version = self.kernel.name.removeprefix("vmlinuz-")
        modules = {path.stem: path for path in (tools / "lib/modules" / version).rglob("*.ko")}
        if "uhid" not in modules:
            raise Missing(f"no module uhid.ko of {version} under {tools}/lib/modules")
        self.modules = [modules[name] for name in MODULES if name in modules]

    def _one(self, pattern: str) -> Path:
        found = [path for path in sorted(self.tools.glob(pattern)) if os.access(path, os.R_OK)]
        if not found:
            raise Missing(f"{self.tools / pattern} is not there or cannot be read")
        return found[-1]

    def run(self, command: list[str], folder: Path, *, environment: dict[str, str], seconds: float) -> str:
        """Everything the machine printed; `folder`: for the initial file system."""
        words = [*(f"{name}={value}" for name, value in environment.items()), *command]
        line = f"cd {shlex.quote(os.getcwd())} && exec env {shlex.join(words)}"
        init = INIT.format(command=shlex.quote(line), ended=ENDED)
        files = {"init": init.encode(), "bin/busybox": self.busybox.read_bytes()}
        files |= {f"modules/{path.name}": path.read_bytes() for path in self.modules}
        image = folder / "initramfs.gz"
        image.write_bytes(gzip.compress(newc(files), 1))
        share = self.tools / "usr/share"
        libraries = [str(self.tools / place / "x86_64-linux-gnu") for place in ("usr/lib", "lib")]
        arguments = [
            *(str(self.qemu), "-accel", "tcg,thread=multi", "-cpu", "max", "-m", "2048", "-smp", "2"),
            *("-L", str(share / "qemu"), "-L", str(share / "seabios")),
            *("-kernel", str(self.kernel), "-initrd", str(image)),
            *("-append", "console=ttyS0 quiet mitigations=off nokaslr tsc=reliable panic=-1 rdinit=/init"),
            *("-nographic", "-no-reboot", "-nodefaults", "-serial", "stdio"),
            *("-virtfs", "local,path=/,mount_tag=host,security_model=none,readonly=on,multidevs=remap"),
        ]
        own = {} if self.tools == Path("/") else {"LD_LIBRARY_PATH": ":".join(libraries)}
        done = subprocess.run(
            arguments,
            stdin=subprocess.DEVNULL,
            capture_output=True,
            text=True,
            errors="replace",
            timeout=seconds,
            env={**os.environ, **own},
        )
        return done.stdout + done.stderr


def newc(files: dict[str, bytes]) -> bytes:
    """A cpio archive of executable files and their folders (format newc, cpio(5))."""
    folders = sorted({str(parent) for name in files for parent in Path(name).parents if str(parent) != "."})
    entries = [(name, 0o040755, b"") for name in folders]
    entries += [(name, 0o100755, data) for name, data in files.items()]
    archive = bytearray()
    for number, (name, mode, data) in enumerate([*entries, ("TRAILER!!!", 0, b"")], start=1):
        encoded = name.encode() + b"\0"
        fields = (number, mode, 0, 0, 1, 0, len(data), 0, 0, 0, 0, len(encoded), 0)
        archive += b"070701" + b"".join(b"%08X" % field for field in fields) + encoded
        archive += bytes(-len(archive) % 4) + data
        archive += bytes(-len(archive) % 4)
    return bytes(archive)
