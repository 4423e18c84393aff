"""Sealing: a recording goes out without its truth, and a salted hash proves later that the truth was not
changed.

`NAME.sealed` holds SHA-256(salt + canonical JSON of the truth); the truth and the salt lie in a file
elsewhere.
"""

from __future__ import annotations

import hashlib
import json
import secrets
from collections.abc import Callable, Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

from palpate.mechanics.disk.reading import sha256_of_file
from palpate.mechanics.disk.writing import JSON, atomic_file
from palpate.mechanics.errors import RecordingError
from palpate.mechanics.recording.recording import Recording, write_recording


def canonical(truth: Mapping[str, Any]) -> bytes:
    """The truth as JSON with sorted keys and no spaces, UTF-8."""
    return json.dumps(truth, sort_keys=True, separators=(",", ":"), allow_nan=False).encode()


def digest(truth: Mapping[str, Any], salt: str) -> str:
    """Hexadecimal SHA-256 of the salt (as text) followed by the canonical truth."""
    return hashlib.sha256(salt.encode() + canonical(truth)).hexdigest()


def seal_of(samples: Path) -> Path:
    """The seal beside a recording's samples."""
    return samples.with_name(samples.name.removesuffix(".gz").removesuffix(".csv") + ".sealed")


def write_sealed(
    path: Path | str,
    recording: Recording,
    truth: Mapping[str, Any],
    truth_path: Path | str,
    write: Callable[[Path, Recording], Path] = write_recording,
) -> Path:
    """Write the recording without truth, `NAME.sealed` beside it, and truth with salt to `truth_path`
    (JSON).

    write: writes a recording as `NAME.csv.gz` and `NAME.toml`. Raises RecordingError where the truth would
    lie beside the recording under its name.
    """
    path, truth_path = Path(path), Path(truth_path)
    salt = secrets.token_hex(32)
    plain = json.loads(canonical(truth))
    samples = write(path, replace(recording, truth=None, object_name="object"))
    seal = seal_of(samples)
    if truth_path.resolve() == seal.resolve():
        raise RecordingError(
            f"--truth {truth_path} is the seal itself: name another file, out of sight of the judge"
        )
    table = {"algorithm": "sha256(salt + canonical json)", "sha256": digest(plain, salt)}
    table["recording_sha256"] = sha256_of_file(samples)
    with atomic_file(seal, JSON) as temporary:
        temporary.write_text(json.dumps(table, indent=1) + "\n", encoding="utf-8")
    with atomic_file(truth_path, JSON) as temporary:
        temporary.write_text(json.dumps({"salt": salt, "truth": plain}, indent=1) + "\n", encoding="utf-8")
    return samples


def opened(seal: Path | str, truth_path: Path | str) -> dict[str, Any]:
    """The truth, after checking that it is the one that was sealed; raises RecordingError where it is not."""
    try:
        table = json.loads(Path(seal).read_text(encoding="utf-8"))
        kept = json.loads(Path(truth_path).read_text(encoding="utf-8"))
        good = digest(kept["truth"], kept["salt"]) == table["sha256"]
    except (OSError, ValueError, KeyError, TypeError) as error:
        raise RecordingError(f"'{seal}' and '{truth_path}' are no seal and truth: {error}") from error
    if not good:
        raise RecordingError(
            f"'{truth_path}' is not what '{seal}' was made of: the truth or the salt was changed"
        )
    return kept["truth"]
