"""The commands that are interrupted at random are commands."""

from __future__ import annotations

from pathlib import Path

import pytest

from palpate.importing.formats.registry import by_suffix
from palpate.operations._run import parser_of

from ..support import interrupts
from ..support.small_disk import SmallDisk


@pytest.mark.parametrize("name", interrupts.COMMANDS)
def test_every_command_that_is_interrupted_is_one_that_works_on_files_that_are_there(name, tmp_path):
    argv = interrupts._jobs(tmp_path, tmp_path)[name].argv
    parser_of(argv[0]).parse_args(argv[1:])
    inputs = [Path(word) for word in argv[1:] if "recordings" in word]
    assert all(file.is_file() for file in inputs)
    assert argv[0] != "import" or inputs[0].suffix in by_suffix()


@pytest.fixture
def small(tmp_path):
    made = SmallDisk(tmp_path / "disk", 1 << 20)
    if not made.mounted:
        pytest.skip("this user may mount no disk in memory")
    yield made
    made.end()


def test_a_small_disk_is_full_until_it_is_emptied(small):
    small.fill()
    with pytest.raises(OSError, match="No space left"):
        (small.folder / "file").write_bytes(b"x")
    small.empty()
    (small.folder / "file").write_bytes(bytes(1 << 19))
    small.end()
    assert not small.mounted and not list(small.folder.iterdir())
