"""What was opened: what it was taken for, then its result as that is shown."""

from __future__ import annotations

from dataclasses import replace

from palpate.importing.kinds import Opened
from palpate.operations._written import import_words, open_words
from palpate.show import story as say
from palpate.show import story_of
from palpate.show.page import feel_step, file_words

SHOWN_AS = "result"


def story(result: Opened) -> say.Story:
    """What it was taken for, then what its result has to say; on a page the other way about."""
    yield say.Title(f"Opened: {', '.join(result.sources)}", suffixed=True)
    first, *more = result.result.lines()
    yield say.Headline(
        f"{', '.join(result.sources)}: taken for {result.understood['took it for']}; {first}", on=say.TEXT
    )
    for key, value in result.understood.items():
        if key != "took it for":
            yield say.Detail(f"{key}: {value}", on=say.TEXT)
    yield from (say.Note(note, on=say.TEXT) for note in result.notes)
    yield from (say.TextLine(line) for line in more)
    for block in story_of(result.result):
        if isinstance(block, say.Next) and (steps := _steps(result)):
            block = say.Next(steps)
        whole = isinstance(block, say.Title) or (isinstance(block, say.Section) and block.evidence)
        if block.on != say.TEXT and not whole:
            yield block if isinstance(block, say.Next) else replace(block, on=say.PAGE)
    yield say.Section("What was the file taken for?", [
        say.Rows(["what", "as"], [[key, value] for key, value in result.understood.items()]),
        *map(say.Note, result.notes),
    ])  # fmt: skip


def _steps(result: Opened) -> list[str]:
    """What to do with a model of which no folder was written, or whose recording is another program's table;
    nothing for another result."""
    from palpate.mechanics.model.model import Model
    from palpate.reconstruction.pipeline import Reconstruction
    from palpate.show.reconstruction.story import as_far_as_believed, mending

    made = getattr(result.result, "model", result.result)
    if not isinstance(made, Model):
        return []
    making = open_words(result.said, {"save": "MODEL"})
    feel = feel_step(made.path, making)
    if not isinstance(result.result, Reconstruction):
        return [] if made.path is not None else [feel]
    if result.result.recording.path is not None and made.path is not None:
        return []
    ways = [f"{way.says}: `{open_words(result.said, way.options)}`" for way in mending(result.result)]
    recording = file_words(result.result.recording.path, "")
    brought = "" if recording else f"`{import_words(result.said, 'REC.csv.gz')}`, "
    model = file_words(made.path, "MODEL")
    # what is believed was kept by the step before, to be felt
    kept = f"`{making}`, " if made.path is None and result.result.doubt else ""
    diagnosed = f"`palpate diagnose {recording or 'REC.csv.gz'} --model {model} --report PAGE.html`"
    left_out = f"see what it leaves out: {kept}{brought}{diagnosed}"
    return as_far_as_believed(result.result, ways, feel, left_out)


KEYS: tuple[say.Key, ...] = (
    "kind",
    ("understood", lambda result: {**result.understood, "notes": result.notes}),
    "odds",
    "result",
)
