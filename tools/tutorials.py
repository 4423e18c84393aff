"""The tutorials' commands as printed, by an installed `palpate` alone, each in an empty folder.

    python tools/tutorials.py BIN [NAME...]    BIN: the folder of the environment's programs

Python blocks are saved under the name that the page gives them and run, shell blocks go through a shell that
stops at the first error, and what a page says is printed must be, its numbers within 3 %: two
environments meshed one recording with 5,983 and with 5,922 nodes. A window needs a screen and a person: where
there is none, `palpate touch` runs headless for some seconds, or as the page says for a notebook; so is said
here. Of the install page the commands before the demo are pip's, of whoever made the environment.
"""

from __future__ import annotations

import os
import re
import subprocess
import sys
import tempfile
import time
from pathlib import Path

PAGES = Path(__file__).resolve().parents[1] / "docs" / "tutorials"
NAMES = ("install", "first-touch", "first-diagnosis", "two-minutes")
BLOCK = re.compile(
    r"(?:^<!-- notebook: (?P<instead>.*?) -->\n)?^```(?P<kind>\w+)\n(?P<code>.*?)^```\n",
    re.DOTALL | re.MULTILINE,
)
SAVED_AS = re.compile(r"save this as `(\w+\.py)`")
PRINTED = re.compile(r"It prints, among other lines:\s*$")
NUMBER = re.compile(r"\d+(?:\.\d+)?")
NEAR = 0.03
NOT_HERE = re.compile(r"^(python3? -m (venv|pip)|source|eval) ?")


def steps(name: str, screen: bool) -> list[tuple[str, str]]:
    """(kind, text) of a page in order: a script 'NAME.py', a 'command', what was 'printed'."""
    page = (PAGES / f"{name}.md").read_text(encoding="utf-8")
    found: list[tuple[str, str]] = []
    for block in BLOCK.finditer(page):
        before = page[: block.start()]
        if block["kind"] == "python" and (saved := SAVED_AS.findall(before)):
            found += [(saved[-1], block["code"]), ("command", f"python {saved[-1]}")]
        elif block["kind"] == "sh":
            lines = [line for line in commands(block) if not NOT_HERE.match(line)]
            if block["instead"] and not screen:
                lines = [block["instead"]]
            found += [("command", line if screen else without_window(line)) for line in lines]
        elif block["kind"] == "text" and PRINTED.search(before):
            found.append(("printed", block["code"]))
    return found


def commands(block: re.Match[str]) -> list[str]:
    """Of a block of a shell, a line each, without remarks."""
    joined = block["code"].replace("\\\n", " ").splitlines()
    return [re.sub(r"\s+#\s.*", "", line) for line in joined if line.strip()]


def without_window(line: str) -> str:
    """A touch that needs no screen."""
    return f"{line} --headless --seconds 5" if re.match(r"palpate touch(?!.*--headless)", line) else line


def is_said(line: str, said: str) -> bool:
    """Whether one of what was said has the line's words, and its numbers within NEAR."""
    words, numbers = NUMBER.split(line.strip()), [float(n) for n in NUMBER.findall(line)]
    for other in said.splitlines():
        if NUMBER.split(other.strip()) == words:
            pairs = zip(numbers, map(float, NUMBER.findall(other)), strict=True)
            if all(abs(one - two) <= NEAR * abs(one) for one, two in pairs):
                return True
    return False


def run(name: str, programs: Path, screen: bool) -> bool:
    """Whether a page's commands do what it says."""
    said, good = "", True
    environment = {k: v for k, v in os.environ.items() if not k.startswith("PYTHON")}
    environment["PATH"] = f"{programs}{os.pathsep}{environment['PATH']}"
    with tempfile.TemporaryDirectory(prefix=f"{name}-") as folder:
        for kind, text in steps(name, screen):
            if kind == "printed":
                missing = [line for line in text.splitlines() if not is_said(line, said)]
                good = good and not missing
                print("".join(f"   not printed: {line}\n" for line in missing), end="")
            elif kind != "command":
                Path(folder, kind).write_text(text, encoding="utf-8")
            else:
                began = time.monotonic()
                done = subprocess.run(
                    text, shell=True, cwd=folder, env=environment, capture_output=True, text=True
                )
                said = done.stdout + done.stderr
                print(f"   {time.monotonic() - began:5.0f} s, exit {done.returncode}: {text}", flush=True)
                if done.returncode or "Traceback" in said:
                    print(said)
                    return False
    return good


def main(programs: str, *names: str) -> int:
    """0 where all do."""
    screen = bool(os.environ.get("DISPLAY") or os.environ.get("WAYLAND_DISPLAY"))
    if not screen:
        print("no screen: windows are not opened, touches run headless")
    failed = []
    for name in names or NAMES:
        print(f"{name}:", flush=True)
        if not run(name, Path(programs).resolve(), screen):
            failed.append(name)
    print(f"failed: {', '.join(failed)}" if failed else "each tutorial runs as printed")
    return len(failed)


if __name__ == "__main__":
    sys.exit(main(*sys.argv[1:]))
