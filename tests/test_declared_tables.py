"""Every declared table that is read: a column or a cell that is wrong is refused by its name."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from functools import partial
from math import inf
from pathlib import Path

import numpy as np
import pytest
from scipy.io import wavfile

from tactileq.analysis.answers.loading import load_responses
from tactileq.experiments.sessions.bids.tables import table_bytes
from tactileq.experiments.tasks.threshold_table import READ, read_answers
from tactileq.modeling import InputError, RecordingSet, Threshold
from tactileq.modeling.files.answer_tables import ANSWER_TABLES, PARTICIPANT_COLUMNS, PARTICIPANT_ID
from tactileq.modeling.files.columns import (
    ABOVE_0,
    Column,
    Columns,
    markdown,
    names,
    sidecar,
    without,
)
from tactileq.modeling.files.others.declared import read_user_table
from tactileq.modeling.files.stimulus_table import STIMULUS_COLUMNS as MANIFEST_COLUMNS
from tactileq.modeling.files.tables import Row, read_table, table_text
from tactileq.modeling.perception.thresholds import THRESHOLD_COLUMNS
from tactileq.modeling.recordings.recording_set import KNOWN_COLUMNS
from tactileq.modeling.recordings.trajectory import TRAJECTORY_COLUMNS, load_trajectory
from tactileq.modeling.scenes.microcontrollers import CONTROLLER_COLUMNS, load_microcontrollers
from tactileq.rig.devices.hand.scripted import SCRIPT_COLUMNS
from tactileq.rig.devices.hand.scripted import ScriptedTrajectory as Script
from tactileq.rig.devices.sound.signals import OF_SURFACES, stimuli_of_surfaces
from tactileq.rig.recording.capture.grid import StrokeGrid
from tactileq.rig.recording.capture.pieces import PIECE_COLUMNS, PieceStore, Plan
from tactileq.rig.recording.importing.labels import LABEL_COLUMNS, labels_from_table

Load = Callable[[Path], object]
ROOT = Path(__file__).parents[1]
PLAN = Plan("oak", StrokeGrid((80.0, 160.0), (0.6,)), 2000.0)


@dataclass(frozen=True)
class Declared:
    """A table that is read: its columns, cells that are right, its place, and what reads it."""

    columns: Columns
    cells: str
    place: str
    load: Load
    more: str = ""  # a second row, where one is too few
    separator: str = "\t"
    prepare: Callable[[Path], None] = lambda _: None

    @property
    def grid(self) -> list[list[str]]:
        rows = [cells.split() for cells in (self.cells, self.more) if cells]
        return [names(self.columns), *([c.replace("_", " ") for c in row] for row in rows)]

    def write(self, folder: Path, grid: list[list[str]]) -> Path:
        self.prepare(folder)
        path = folder / self.place
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text("".join(self.separator.join(row) + "\n" for row in grid))
        return path


def sound(name: str, folder: Path) -> None:
    """A WAV file of 400 samples."""
    (folder / name).parent.mkdir(parents=True, exist_ok=True)
    samples = np.random.default_rng(0).normal(0, 0.1, 400).astype(np.float32)
    wavfile.write(folder / name, 2000, samples)


def study(folder: Path) -> None:
    """A data set of people, with an answer to the relative task."""
    told = dict.fromkeys(("Simulated", "SimulatedParticipant", "SimulatedRig"), False)
    (folder / "dataset_description.json").write_text(json.dumps(told))
    (folder / "participants.tsv").write_text("participant_id\tsimulated\nsub-01\tfalse\n")
    path = folder / "sub-01/ses-01/beh/sub-01_ses-01_task-relative_beh.tsv"
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text("\n".join("\t".join(row) for row in TABLES["relative"].grid) + "\n")


def stimuli(table: Path) -> object:
    """The set's file, whose hash the manifest has as `sha`."""
    found = hashlib.sha256((table.parent / "a.wav").read_bytes()).hexdigest()
    table.write_text(table.read_text().replace("\tsha\t", f"\t{found}\t"))
    return stimuli_of_surfaces(table.parent, label="full", textures=["oak"])


def of_task(task: str, cells: str) -> Declared:
    place = f"sub-01/ses-01/beh/sub-01_ses-01_task-{task}_beh.tsv"
    columns = ANSWER_TABLES[task].columns
    return Declared(columns, cells, place, lambda t: load_responses(t.parents[3]), prepare=study)


TABLES = {
    "recordings": Declared(
        KNOWN_COLUMNS,
        "a.wav oak 80.0 0.6 2000.0 g 1 false 400 0.0 16.0 1",
        "recordings.tsv",
        lambda table: RecordingSet.load(table.parent),
        prepare=partial(sound, "a.wav"),
    ),
    "labels": Declared(
        LABEL_COLUMNS,
        "a.wav 80.0 0.6 oak 1 16.0 1",
        "labels.tsv",
        lambda table: labels_from_table(table, [Path("a.wav")], texture=None),
    ),
    "pieces": Declared(
        PIECE_COLUMNS,
        "00001.wav oak 80.0 0.6 1 2000.0 400 80.0 1.0 0.6 0.1 false true",
        "pieces/pieces.tsv",
        lambda table: PieceStore(table.parents[1], PLAN),
        prepare=partial(sound, "pieces/00001.wav"),
    ),
    "manifest": Declared(
        OF_SURFACES,
        "a.wav g pcm24 16.0 sha n/a false oak full 0f still 80.0 0.6 0.0",
        "manifest.tsv",
        stimuli,
        prepare=partial(sound, "a.wav"),
    ),
    "microcontrollers": Declared(
        CONTROLLER_COLUMNS, "m4 Cortex-M4F 8e7 65536 5 sheet", "m.tsv", load_microcontrollers
    ),
    "threshold table": Declared(
        without(THRESHOLD_COLUMNS, "displacement_um"),
        "10 1",
        "own.tsv",
        Threshold.load,
        more="20 2",
    ),
    "displacements": Declared(
        without(THRESHOLD_COLUMNS, "acceleration_g"), "10 1", "own.tsv", Threshold.load, more="20 2"
    ),
    "trajectory": Declared(
        TRAJECTORY_COLUMNS,
        "0 80 1",
        "hand.csv",
        lambda table: load_trajectory(table, name="hand"),
        more="1 nan nan",
        separator=",",
    ),
    "script": Declared(SCRIPT_COLUMNS, "0 0 0 1", "hand.tsv", Script.load, more="1 10 0 1"),
    "participants": Declared(
        (PARTICIPANT_ID, *PARTICIPANT_COLUMNS),
        "sub-01 3 enrolled v1 en false false",
        "participants.tsv",
        lambda table: load_responses(table.parent),
        prepare=study,
    ),
    "absolute": of_task("absolute", "1 main oak full A oak real 50 60.5 3 2.5 1 1 n/a false false"),
    "relative": of_task("relative", "1 main oak full A oak|elm oak 1 2 2.5 1 1 n/a false false"),
    "oddity": of_task("oddity", "1 main oak full A full|AR|AR 1 1 1 2 2.5 oak 1 1 n/a false false"),
    "threshold": of_task("threshold", "1 main n/a n/a n/a 250 0.1 1 2 2 1 2.5 1 1 n/a false false"),
    "threshold answers": Declared(
        READ,
        "main 250 0.1 1 1 1 false false",
        "sub-01/ses-01/beh/sub-01_ses-01_task-threshold_beh.tsv",
        lambda table: read_answers(table.parents[3]),
    ),
}


def wrong_cells(column: Column) -> Iterator[str]:
    """Cells that cannot stand in a column."""
    if column.required:
        yield from ("", "n/a")
    if column.limits is None:
        yield from ["other"] * bool(column.levels)
        return
    low, high = column.limits
    yield from (
        "much",
        "inf",
        *["-inf"] * (not column.silence),
        *["nan"] * (not column.nan),
        *["1.5"] * column.whole,
    )
    if low > -inf:
        yield "0" if low == ABOVE_0 else repr(low - 1)
    if high < inf:
        yield repr(high * 2)


CELLS = [
    (name, place, cell)
    for name, table in TABLES.items()
    for place, column in enumerate(table.columns)
    for cell in wrong_cells(column)
]
EVERY = [(name, place) for name, table in TABLES.items() for place in range(len(table.columns))]


def check_refused(table: Declared, folder: Path, grid: list[list[str]], *, named: str) -> None:
    path = table.write(folder, grid)
    with pytest.raises(InputError) as caught:
        table.load(path)
    sentence = str(caught.value).replace(str(path), "THE TABLE")
    assert "THE TABLE" in sentence
    assert named in sentence
    assert sentence.endswith(".")
    assert sentence.count("; ") >= 1
    assert not {"\n", ". "} & {sentence, *sentence}


@pytest.mark.parametrize("name", TABLES)
def test_what_is_right_is_read_and_is_the_same_when_it_was_written(
    name: str, tmp_path: Path
) -> None:
    table = TABLES[name]
    path = table.write(tmp_path, table.grid)
    assert table.load(path) is not None
    read = partial(read_user_table, what="a table") if table.separator == "," else read_table
    read = partial(read, columns=table.columns)
    rows = read(path)
    assert [names(table.columns)] * len(rows) == [list(row) for row in rows]
    path.write_text(table_text(table.columns, rows).replace("\t", table.separator))
    again = read(path)
    assert repr(again) == repr(rows)  # NaN is not NaN


@pytest.mark.parametrize(("name", "place", "cell"), CELLS)
def test_a_cell_that_cannot_stand_there(name: str, place: int, cell: str, tmp_path: Path) -> None:
    table = TABLES[name]
    grid = table.grid
    grid[1][place] = cell
    check_refused(table, tmp_path, grid, named=table.columns[place].name)


@pytest.mark.parametrize(("name", "place"), EVERY)
@pytest.mark.parametrize("change", ["misspelt", "doubled", "missing"])
def test_columns_that_are_not_those_declared(
    name: str, place: int, change: str, tmp_path: Path
) -> None:
    table = TABLES[name]
    column, grid = table.columns[place], table.grid
    if change == "misspelt":
        grid[0][place] += "x"
    elif change == "doubled":
        grid = [[*row, row[place]] for row in grid]
    else:
        grid = [row[:place] + row[place + 1 :] for row in grid]
    if change == "missing" and column.optional and column not in THRESHOLD_COLUMNS:
        assert table.load(table.write(tmp_path, grid)) is not None
    else:
        check_refused(table, tmp_path, grid, named=column.name)


@pytest.mark.parametrize("name", TABLES)
@pytest.mark.parametrize("change", ["short", "long"])
def test_a_row_of_another_length(name: str, change: str, tmp_path: Path) -> None:
    table = TABLES[name]
    grid = table.grid
    grid[1] = grid[1][:-1] if change == "short" else [*grid[1], "1"]
    check_refused(table, tmp_path, grid, named="line 2")


@pytest.mark.parametrize("name", TABLES)
def test_a_table_without_anything(name: str, tmp_path: Path) -> None:
    check_refused(TABLES[name], tmp_path, [], named="empty")


def test_a_column_is_added_by_declaring_it(tmp_path: Path) -> None:
    """Reader, writers, sidecar and page of the documentation follow."""
    own = Column(
        "damping", unit="dB", description="Of the pen", limits=(0, 60), levels={}, optional=True
    )
    columns = (*TABLES["microcontrollers"].columns, own)
    rows: list[Row] = [{"name": "m4", "core": "M4", "source": "own", "damping": 3.5}]
    rows[0] |= {"clock_hz": 8e7, "memory_bytes": 1, "cycles_per_operation": 5.0}
    for written in (table_text(columns, rows).encode(), table_bytes(columns, rows)):
        (tmp_path / "t.tsv").write_bytes(written)
        assert read_table(tmp_path / "t.tsv", columns) == rows
        (tmp_path / "t.tsv").write_bytes(written.replace(b"3.5", b"61"))
        with pytest.raises(InputError, match="from 0 to 60 dB in column damping"):
            read_table(tmp_path / "t.tsv", columns)
    assert sidecar(columns)["damping"] == {"Description": "Of the pen", "Units": "dB"}
    assert "| `damping` | Of the pen | dB | a number from 0 to 60, or n/a" in markdown(columns)
    assert replace(own, unit="").heading == "damping"


def test_a_manifest_is_read_by_columns_that_it_has() -> None:
    assert set(OF_SURFACES) <= set(MANIFEST_COLUMNS)
