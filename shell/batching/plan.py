"""Which recordings there are, what each is called in the output, and the tasks that they become.

All of a batch: find, plan, do, and write what came out beside the recordings' folders.
"""

from __future__ import annotations

import glob
import os
from collections import Counter
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from palpate.batching.summary import Batch, agreements, entry_of, write_csv, write_parquet
from palpate.mechanics.disk.reading import read_toml, reading, sha256_of_file
from palpate.mechanics.disk.writing import Kind, atomic_file, sole_writer
from palpate.mechanics.errors import OptionError, PalpateError, RecordingError
from palpate.mechanics.progress import Progress
from palpate.mechanics.recording.files import recording_files
from palpate.operations._declare import check_options
from palpate.parallel.run import Outcome, run_with_bar
from palpate.parallel.tasks import Task

STEPS = ("reconstruct", "compare", "diagnose")
MODEL, THUMBNAIL = "model", "thumbnail.png"

MEMORY_BYTES = {"reconstruct": 1_450_000_000, "compare": 1_300_000_000, "diagnose": 1_300_000_000}
"""What a step takes at most before anything is measured."""

_ENDINGS = (".csv.gz", ".csv", ".toml")


@dataclass(frozen=True)
class FoundRecordings:
    """A recording: its file, and its name, which is that of its folder in the output."""

    name: str
    path: Path


@dataclass(frozen=True)
class BatchChoice:
    """What is to be done with every recording. steps: of STEPS, in order; options: step -> keywords of the
    operation; reports: HTML pages too."""

    steps: tuple[str, ...] = STEPS
    options: Mapping[str, Mapping[str, Any]] | None = None
    seed: int = 0
    reports: bool = True

    def __post_init__(self) -> None:
        unknown = [step for step in self.steps if step not in STEPS]
        if unknown or not self.steps:
            raise OptionError(f"--do {','.join(self.steps)}: allowed are {', '.join(STEPS)}")
        wanted = {"reconstruct", *self.steps}
        object.__setattr__(self, "steps", tuple(step for step in STEPS if step in wanted))
        for step, values in (self.options or {}).items():
            if step not in STEPS:
                raise OptionError(f"options of '{step}': allowed are those of {', '.join(STEPS)}")
            if "seed" in values:
                raise OptionError(f"{step}.seed: one seed is for all steps; give --seed, or seed=")
            check_options(step, values)

    def of(self, step: str) -> dict[str, Any]:
        """The options of one step."""
        return dict((self.options or {}).get(step, {}))


def find(sources: Iterable[str | Path], leave: Path) -> list[FoundRecordings]:
    """Recordings in folders and all below them, by pattern, or by name; in the order of their paths.

    leave: the output, which is not looked into. Two of one name get as much of their folders before it as
    tells them apart. Raises OptionError where a source leads to none.
    """
    roots: dict[Path, Path] = {}
    for source in sources:
        given = list(_of_source(Path(source), absolute(leave)))
        if not given:
            raise OptionError(f"'{source}' leads to no recording: name folders, patterns or files")
        for path, root in given:
            roots.setdefault(path, root)
    if not roots:
        raise OptionError("no recordings were named: name folders, patterns or files")
    paths = sorted(roots)
    return [FoundRecordings(name, path) for name, path in zip(_names(paths, roots), paths, strict=True)]


def _of_source(source: Path, leave: Path) -> Iterable[tuple[Path, Path]]:
    """(samples, root) of the recordings that a source leads to; a named file that is none comes too, so that
    its reason is said."""
    if source.is_dir():
        for path in sorted(source.rglob("*.toml")):
            whole = absolute(path)
            described = any(path.with_suffix(ending).is_file() for ending in _ENDINGS[:2])
            if not whole.is_relative_to(leave) and described:
                yield recording_files(whole)[0], absolute(source)
    elif source.exists():
        yield _samples(source), absolute(source).parent
    else:
        root = source
        while glob.has_magic(str(root)):
            root = root.parent
        for match in sorted(glob.glob(str(source), recursive=True)):
            path = Path(match)
            if path.is_dir() or path.name.endswith(_ENDINGS):
                for found, _ in _of_source(path, leave):
                    yield found, absolute(root)


def undescribed(sources: Iterable[str | Path], leave: Path) -> list[Path]:
    """Tables in the folders that no .toml beside them makes a recording."""
    return sorted(
        path
        for source in map(Path, sources)
        if source.is_dir()
        for ending in _ENDINGS[:2]
        for path in source.rglob(f"*{ending}")
        if not absolute(path).is_relative_to(leave)
        and not path.with_name(path.name.removesuffix(ending) + ".toml").is_file()
    )


def _samples(path: Path) -> Path:
    try:
        return recording_files(absolute(path))[0]
    except RecordingError:
        return absolute(path)


def absolute(path: str | Path) -> Path:
    """From the root, without '..'; links stay, as names may be theirs."""
    return Path(os.path.abspath(path))


def _names(paths: Sequence[Path], roots: Mapping[Path, Path]) -> list[str]:
    """A name a recording: its place below its root, and above it as far as needed; '-' between folders."""
    parts = [(*path.parts[1:-1], _stem(path)) for path in paths]
    depth = [len(path.parts) - len(roots[path].parts) for path in paths]
    while True:
        names = ["-".join(part[-k:]) for part, k in zip(parts, depth, strict=True)]
        count = Counter(names)
        longer = [k for k, name in enumerate(names) if count[name] > 1 and depth[k] < len(parts[k])]
        if not longer:
            break
        for k in longer:
            depth[k] += 1
    seen: Counter[str] = Counter()
    for k, name in enumerate(names):
        seen[name] += 1
        names[k] = name if seen[name] == 1 else f"{name}-{seen[name]}"
    return names


def _stem(path: Path) -> str:
    return next((path.name.removesuffix(e) for e in _ENDINGS if path.name.endswith(e)), path.name)


def content_of(recording: str | Path, shape: str = "") -> dict[str, str]:
    """SHA-256 of each of a recording's files: samples, description, and what stands in for the geometry: the
    shape or the model that the description names, or the shape that the options do.

    Raises RecordingError where the recording is missing or its description no TOML.
    """
    samples, description = recording_files(recording)
    about = read_toml(description, RecordingError).get("object", {})
    named = [about.get(key) for key in ("shape", "model")] if isinstance(about, dict) else []
    files = {"samples": samples, "description": description, "stated shape": Path(shape)}
    for key, value in zip(("shape", "model"), named, strict=False):
        if isinstance(value, str):
            place = description.parent / value
            files |= {key: place, **{f"{key}/{name}": place / name for name in ("model.toml", "mesh.vtu")}}
    with reading(samples, RecordingError):
        return {name: sha256_of_file(path) for name, path in files.items() if path.is_file()}


def tasks_of(found: FoundRecordings, choice: BatchChoice, out: Path) -> list[Task]:
    """The recording's tasks, in order; raises RecordingError where its files cannot be read."""
    options = {step: choice.of(step) for step in choice.steps}
    shape = options["reconstruct"].pop("shape", "")  # a place: what counts is what the file holds
    shape = str(absolute(shape)) if shape else ""
    sha256, folder = content_of(found.path, shape), out / found.name
    places = {"recording": str(found.path), "shape": shape, "folder": str(folder)}
    made: list[Task] = []
    for step in choice.steps:
        first = step == "reconstruct"
        report = [folder / f"{step}.html"] if choice.reports else []
        made.append(
            Task(
                function=f"palpate.batching.steps:{step}",
                content={
                    "sha256": sha256,
                    "options": options[step],
                    "seed": choice.seed,
                    "reports": choice.reports,
                },
                record=folder / ".finished" / f"{step}.json",
                places=places,
                products=(
                    folder / f"{step}.json",
                    *report,
                    *((folder / MODEL / "model.toml", folder / THUMBNAIL) if first else ()),
                ),
                needs=() if first else (made[0].name,),
                stage=step,
                label=found.name,
                memory_bytes=MEMORY_BYTES[step],
            )
        )
    return made


_TRACE = Kind("a trace", (b"Traceback",))


def batch(
    sources: Iterable[str | Path],
    out: str | Path,
    choice: BatchChoice,
    *,
    workers: int | None = None,
    scheduler: str | None = None,
    memory_bytes: int | None = None,
    force: bool = False,
    progress: bool | Progress = True,
) -> Batch:
    """Do what is not finished of all recordings; the summary is written when the user stops it, too.

    Raises OptionError for sources that lead to nothing and what `parallel.engines.engine` refuses, FileError
    for an output that cannot be written or where another batch writes.
    """
    folder = absolute(out)
    sources = list(sources)
    found = find(sources, folder)
    bad: dict[str, str] = {}
    tasks: dict[str, list[Task]] = {}
    for recording in found:
        try:
            tasks[recording.name] = tasks_of(recording, choice, folder)
        except PalpateError as error:
            bad[recording.name] = " ".join(str(error).split())
    outcomes: dict[str, Outcome] = {}

    def made() -> Batch:
        entries = []
        for recording in found:
            own = tasks.get(recording.name, [])
            ended = {task.stage: outcomes[task.name] for task in own if task.name in outcomes}
            entries.append(entry_of(recording.name, ended, bad.get(recording.name), choice.steps))
        reused = sum(outcome.reused for outcome in outcomes.values())
        planned = sum(map(len, tasks.values()))
        agreeing = tuple(agreements(entries))
        return Batch(folder, tuple(entries), agreeing, planned, reused, steps=tuple(choice.steps))

    with sole_writer(folder):
        try:
            run_with_bar(
                (task for own in tasks.values() for task in own),
                folder,
                workers=workers,
                scheduler=scheduler,
                memory_bytes=memory_bytes,
                force=force,
                progress=progress,
                outcomes=outcomes,
            )
        except KeyboardInterrupt:
            _write(made())
            raise
        whole = replace(made(), undescribed=tuple(undescribed(sources, folder)))
        _write(whole)
    return whole


def _write(made: Batch) -> None:
    for entry in made.entries:
        log = made.folder / entry.row.recording / "error.txt"
        if entry.trace:
            with atomic_file(log, _TRACE) as temporary:
                temporary.write_text(entry.trace, encoding="utf-8")
        else:
            log.unlink(missing_ok=True)
    write_csv(made.folder / "summary.csv", made.rows)
    write_parquet(made.folder / "summary.parquet", made.rows)
    made.report(made.folder / "index.html")
