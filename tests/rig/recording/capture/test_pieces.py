"""Pieces on the disk: what was kept is there, whatever ended the run, and fills the recordings."""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
import threading
from itertools import pairwise
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.io import wavfile

from tactileq.modeling import InputError, Recording, RecordingSet
from tactileq.modeling.files.locks import Lock
from tactileq.modeling.files.places import locked
from tactileq.rig.recording.capture.cutting import StrokePart
from tactileq.rig.recording.capture.grid import StrokeGrid
from tactileq.rig.recording.capture.joining import joined
from tactileq.rig.recording.capture.pieces import PieceStore, Plan
from tests.refusals import refused

RATE_HZ = 2000.0
GRID = StrokeGrid([80.0, 160.0], [0.6])


def plan(**changes) -> Plan:
    return Plan(**{"texture": "oak", "grid": GRID, "rate_hz": RATE_HZ, "wanted_s": 0.5} | changes)


def piece(seconds: float = 0.2, *, speed: float = 80.0, seed: int = 0, **changes) -> StrokePart:
    samples = np.random.default_rng(seed).normal(size=round(seconds * RATE_HZ))
    values = {
        "clipped": False,
        "silent": False,
        "simulated": False,
        "force_assumed": False,
    } | changes
    return StrokePart((speed, 0.6), samples, 1.0, speed + 1, 2.0, 0.61, 0.02, **values)


def test_a_condition_is_recorded_once_its_pieces_suffice(tmp_path: Path) -> None:
    store = PieceStore(tmp_path / "oak", plan(), provenance={"command": "tactileq record"})
    assert [store.add(piece(seed=n)) for n in range(2)] == [True, True]
    assert store.coverage.seconds.ravel() == pytest.approx([0.38, 0.0])
    assert (tmp_path / "oak/recordings.tsv").is_file()
    assert store.add(piece(seed=2))
    assert store.coverage.seconds.ravel() == pytest.approx([0.5, 0.0])
    (record,) = RecordingSet.load(tmp_path / "oak")
    pieces = [piece(seed=n).samples_g.astype(np.float32).astype(float) for n in range(3)]
    whole = joined(pieces, RATE_HZ)[:1000].astype(np.float32)
    assert record == Recording(whole, RATE_HZ, 80.0, 0.6, "oak", clipped_share=0.0)
    assert not store.add(piece(seed=3))  # more than is wanted
    assert not store.add(piece(speed=160.0, clipped=True))
    assert not store.add(piece(speed=160.0, silent=True))
    store.finish({"input": {"lost_at_places": 2}})
    told = json.loads((tmp_path / "oak/provenance.json").read_text())
    assert told["pieces"] == {"kept": 3, "clipped": 1, "silent": 1, "surplus": 1}
    assert told["input"] == {"lost_at_places": 2}
    table = (tmp_path / "oak/pieces/pieces.tsv").read_text().splitlines()
    assert table[3].split("\t") == [
        *("00003.wav", "oak", "80.0", "0.6", "1", "2000.0", "400"),
        *("81", "2", "0.61", "0.02", "false", "false"),
    ]


@given(
    st.lists(st.tuples(st.sampled_from([80.0, 160.0]), st.integers(200, 900)), max_size=12),
    st.lists(st.integers(0, 12), max_size=4),
)
@settings(max_examples=15)
def test_opened_again_it_goes_on_with_what_is_missing(strokes, ends) -> None:
    """However strokes are spread over runs, the same is kept, covered and recorded."""
    every = [piece(n / RATE_HZ, speed=v, seed=k) for k, (v, n) in enumerate(strokes)]
    with TemporaryDirectory() as folder:
        places = [0, *sorted(min(end, len(every)) for end in ends), len(every)]
        once, more = Path(folder) / "once", Path(folder) / "more"
        for target, runs in ((once, [every]), (more, [every[a:b] for a, b in pairwise(places)])):
            for run in runs:
                store = PieceStore(target, plan())
                for one in run:
                    store.add(one)
        stores = [PieceStore(target, plan()) for target in (once, more)]
        assert np.array_equal(stores[0].coverage.seconds, stores[1].coverage.seconds)
        if every:
            tables = [(target / "pieces/pieces.tsv").read_text() for target in (once, more)]
            assert tables[0] == tables[1]
        assert _recordings(once) == _recordings(more)
        assert len(_recordings(once)) == stores[0].coverage.full.sum()


def test_of_two_who_record_into_one_folder_none_loses_a_piece(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """While one of them waits for the folder, the other one keeps a piece there."""
    first, second = (PieceStore(tmp_path / "oak", plan(wanted_s=2.0)) for _ in range(2))
    first.add(piece(seed=0))
    adding = threading.Thread(target=second.add, args=(piece(seed=1),))
    waits, acquire = threading.Event(), Lock.acquire

    def told(self: Lock, wait_s: float) -> None:
        if threading.current_thread() is adding:
            waits.set()
        acquire(self, wait_s)

    monkeypatch.setattr(Lock, "acquire", told)
    with locked(tmp_path / "oak/pieces/pieces.tsv") as table:
        adding.start()
        assert waits.wait(500)
        first.add(piece(seed=2))
    adding.join()
    files = [line.split("\t")[0] for line in table.read_text().splitlines()[1:]]
    kept = [wavfile.read(table.with_name(file))[1].tolist() for file in files]
    assert kept == [piece(seed=n).samples_g.astype(np.float32).tolist() for n in (0, 2, 1)]


def test_less_is_wanted_the_second_time(tmp_path: Path) -> None:
    store = PieceStore(tmp_path / "oak", plan())
    store.add(piece())
    store.add(piece(seed=1))
    assert PieceStore(tmp_path / "oak", plan(wanted_s=0.3)).coverage.full.ravel().tolist() == [
        True,
        False,
    ]
    (record,) = RecordingSet.load(tmp_path / "oak")
    assert record.duration_s == 0.3


def test_repeats_and_textures_do_not_mix(tmp_path: Path) -> None:
    for changes in ({}, {"repeat": 2}, {"texture": "elm", "simulated": True}):
        store = PieceStore(tmp_path / "set", plan(**changes))
        assert not store.coverage.seconds.any()
        for seed in range(3):
            store.add(piece(seed=seed))
    found = [(r.texture, r.repeat, r.simulated) for r in RecordingSet.load(tmp_path / "set")]
    assert found == [("oak", 1, False), ("oak", 2, False), ("elm", 1, True)]


def test_one_simulated_piece_makes_a_simulated_recording(tmp_path: Path) -> None:
    store = PieceStore(tmp_path / "oak", plan())
    for seed in range(3):
        store.add(piece(seed=seed, simulated=seed == 1))
    assert RecordingSet.load(tmp_path / "oak").recordings[0].simulated


def test_it_adds_to_another_recording_set(tmp_path: Path) -> None:
    imported = Recording(np.sin(np.arange(100)), 500.0, 80.0, 0.6, "oak")
    RecordingSet([imported]).save(tmp_path / "oak")
    store = PieceStore(tmp_path / "oak", plan())
    assert store.coverage.full.ravel().tolist() == [True, False]
    for seed in range(3):
        store.add(piece(speed=160.0, seed=seed))
    assert [r.speed_mm_s for r in RecordingSet.load(tmp_path / "oak")] == [80.0, 160.0]


@pytest.mark.parametrize(
    "spoil",
    [
        lambda folder: (folder / "other.txt").write_text("x"),
        lambda folder: folder.rmdir() or folder.write_text("x"),
    ],
)
def test_other_folders_are_refused(tmp_path: Path, spoil) -> None:
    (tmp_path / "oak").mkdir()
    spoil(tmp_path / "oak")
    with refused(InputError, expected=["folder", "recordings"], got=tmp_path / "oak"):
        PieceStore(tmp_path / "oak", plan())


def test_another_rate_and_a_damaged_table_are_refused_and_a_changed_piece_does_not_count(
    tmp_path: Path,
) -> None:
    store = PieceStore(tmp_path / "oak", plan())
    store.add(piece())
    with refused(InputError, expected=["4000 Hz", tmp_path / "oak"], got=["2000 Hz", "--rate"]):
        PieceStore(tmp_path / "oak", plan(rate_hz=4000.0))
    table = tmp_path / "oak/pieces/pieces.tsv"
    good = table.read_text()
    table.write_text(good.replace("00001.wav", "../../1.wav"))
    with refused(InputError, expected=["00001.wav", "pieces/pieces.tsv"], got="'../../1.wav'"):
        PieceStore(tmp_path / "oak", plan())
    table.write_text(good.replace("\t400\t", "\t401\t"))
    store = PieceStore(tmp_path / "oak", plan())
    assert not store.coverage.seconds.any()
    assert "expected 401 samples in" in store.damaged[0]


def test_plans_out_of_range_are_refused() -> None:
    with refused(InputError, expected="0.2 s", got="0.1 s"):
        plan(wanted_s=0.1)
    with refused(InputError, expected="texture", got="''"):
        plan(texture="")


KILLED = """
import sys
from pathlib import Path
sys.path.insert(0, {here!r})
import test_pieces as t
store = t.PieceStore(Path({folder!r}), t.plan(wanted_s=2.0))
for n in range(10_000):
    store.add(t.piece(speed=(80.0, 160.0)[n % 2], seed=n))
    print(n, flush=True)
"""


@pytest.mark.parametrize("after", [0, 3, 17])
def test_after_sigkill_all_pieces_but_the_current_one_are_there(tmp_path: Path, after: int) -> None:
    folder = tmp_path / "oak"
    text = KILLED.format(here=str(Path(__file__).parent), folder=str(folder))
    run = subprocess.Popen(
        [sys.executable, "-c", text],
        stdout=subprocess.PIPE,
        text=True,
        env={**os.environ, "PYTHONPATH": os.pathsep.join(sys.path)},
    )
    assert run.stdout is not None
    for _ in range(after + 1):
        told = int(run.stdout.readline())
    run.send_signal(signal.SIGKILL)
    run.wait()
    store = PieceStore(folder, plan(wanted_s=2.0))
    kept = (folder / "pieces/pieces.tsv").read_text().splitlines()[1:]
    assert len(kept) >= told + 1
    sizes = [int(sum(line.split("\t")[2] == speed for line in kept)) for speed in ("80.0", "160.0")]
    seconds = [max(n * 0.2 - max(n - 1, 0) * 0.02, 0.0) for n in sizes]
    found = store.coverage.seconds.ravel()
    assert found == pytest.approx(np.minimum(seconds, 2.0))
    assert not [p for p in folder.rglob("*.unfinished")]
    for place, condition in enumerate(GRID.conditions):
        recorded = [r for r in _recordings(folder) if r.condition == condition]
        assert len(recorded) == (found[place] >= 2.0)


def _recordings(folder: Path) -> list[Recording]:
    index = folder / "recordings.tsv"
    lines = index.read_text().splitlines() if index.is_file() else []
    return list(RecordingSet.load(folder)) if len(lines) > 1 else []
