"""What commands print: progress, errors, notes and warnings."""

from __future__ import annotations

import sys
from collections.abc import Callable, Iterable, Iterator, Sequence
from contextlib import contextmanager
from itertools import combinations
from pathlib import Path
from typing import TYPE_CHECKING

from tactileq.modeling.errors import shortened
from tactileq.modeling.files.reading import reason_of

if TYPE_CHECKING:
    from tactileq.experiments.study.models import ModelSets
    from tactileq.modeling import RecordingSet
    from tactileq.modeling.models.loading import AnyModel


def sentence_of(error: Exception) -> str:
    """The sentence that a user sees for an error, never a traceback."""
    # A StoreError has its own sentence, the system's errors only a number and a word.
    if isinstance(error, OSError) and error.errno is not None:
        place = "a file" if error.filename is None else shortened(str(error.filename), longest=200)
        return (
            f"expected to read or write {place}, got {reason_of(error)}; check the path, its "
            "permissions and the space on the disk."
        )
    if isinstance(error, MemoryError):
        return "expected a task that fits into memory, got a larger one; process less at once."
    return str(error)


def print_warning(message: Warning | str, *where: object, **more: object) -> None:
    """Print a warning as one line, for `warnings.showwarning`."""
    print(f"warning: {message}", file=sys.stderr)


@contextmanager
def progress(title: str, total: int) -> Iterator[Callable[[str], None]]:
    """A progress bar over countable steps; in a log one line at the end."""
    from rich.progress import (
        BarColumn,
        MofNCompleteColumn,
        Progress,
        TextColumn,
        TimeRemainingColumn,
    )

    columns = (
        TextColumn("{task.description}", markup=False),
        BarColumn(),
        MofNCompleteColumn(),
        TimeRemainingColumn(elapsed_when_finished=True),
        TextColumn("{task.fields[item]}", markup=False),
    )
    with Progress(*columns) as bar:
        task = bar.add_task(title, total=total, item="")
        yield lambda item: bar.update(task, advance=1, item=item)
        bar.update(task, item="")


@contextmanager
def share_of(title: str) -> Iterator[Callable[[float, str], None]]:
    """A progress bar for work that reports its share done (0–1)."""
    from rich.progress import Progress, TextColumn

    _, *columns = Progress.get_default_columns()
    with Progress(TextColumn("{task.description}", markup=False), *columns) as bar:
        task = bar.add_task(title, total=1.0)
        yield lambda share, what: bar.update(task, completed=share)


def left_out_warnings(texture: str, refusals: Iterable[str]) -> list[str]:
    """One sentence for every recording of a texture that cannot be used."""
    return [f"warning: {texture}: left out: {refusal}" for refusal in refusals]


def clipping_warnings(records: RecordingSet) -> list[str]:
    """One sentence for every clipped recording."""
    return [
        f"warning: {recording.describe()} is clipped in {recording.clipped_share:.2%} of its "
        "samples; its level is too low."
        for recording in records.recordings
        if recording.clipped_share > 0
    ]


def simulated_note(model: AnyModel) -> str:
    """The mark of a simulated model in a printed line."""
    return " (simulated)" if model.simulated else ""


def print_models(sets: ModelSets, textures: Sequence[str]) -> None:
    """Name textures whose models are identical in two sets, and models from outside the sets.

    Not for an experimenter who has to stay blind; for them use `print_foreign_models` only.
    """
    for first, second in combinations(sets.names, 2):
        if controls := sets.identical(textures, (first, second)):
            print(
                f"note: {first} and {second} are identical for {', '.join(controls)}: a control; "
                "there is nothing to compare."
            )
    print_foreign_models(sets, textures)


def print_foreign_models(sets: ModelSets, textures: Sequence[str]) -> None:
    """Name models that were made from a model that is in none of the sets."""
    for texture, name in sets.of_others(textures):
        print(
            f"warning: the {name} model of {texture} was made from a model that is in none of the "
            "sets; simplify again the model that it is compared with."
        )


def usable_recordings(folder: Path, texture: str) -> RecordingSet:
    """The recordings of one texture; what cannot be used is left out with a warning."""
    from tactileq.modeling.recordings.recording_set import load_usable

    records, unusable = load_usable(folder, texture=texture)
    for warning in left_out_warnings(texture, unusable):
        print(warning, file=sys.stderr)
    return records
