"""Parts of the program that run in processes of their own are of the same installation as their parent."""

from __future__ import annotations

import subprocess
from pathlib import Path

from palpate.child import module_command


def test_a_checkout_in_the_current_folder_does_not_shadow_the_parents_packages(tmp_path: Path) -> None:
    shadow = tmp_path / "palpate"
    shadow.mkdir()
    (shadow / "__init__.py").write_text("raise SystemExit('the wrong palpate')")
    command = module_command("palpate.child")
    done = subprocess.run(command, cwd=tmp_path, capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
