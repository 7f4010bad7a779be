"""Additions to a recording set: what is there stays as it is, whatever becomes of the addition."""

from __future__ import annotations

import errno
import os
import shutil
import signal
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
import soundfile

from tactileq.modeling import InputError, Recording, RecordingSet
from tactileq.modeling.files.wav import read_wav
from tactileq.modeling.recordings.appending import UNFINISHED_NAME, WavSource, append
from tactileq.modeling.recordings.recording_set import INDEX_NAME
from tests.refusals import refused

NOISE = np.random.default_rng(1).uniform(-0.9, 0.9, (500, 3))


def recording(speed_mm_s: float, samples: np.ndarray = NOISE[:, 0], unit: str = "g") -> Recording:
    return Recording(samples, 8000.0, speed_mm_s, 1.0, "felt", unit=unit)


def wav_recording(
    path: Path, speed_mm_s: float, *, scale: float | None = None, channel: int = 1
) -> tuple[Recording, WavSource]:
    """A WAV file of three channels, and the recording that an import makes of it."""
    soundfile.write(path, NOISE * speed_mm_s / 1000, 8000, subtype="PCM_16")
    samples, _ = read_wav(path, channel=channel)
    unit = "arbitrary" if scale is None else "g"
    made = recording(speed_mm_s, samples * (scale or 1.0), unit)
    return made, WavSource(path, channel, scale)


def contents(folder: Path) -> dict[str, bytes]:
    return {path.name: path.read_bytes() for path in folder.iterdir()}


def identities(folder: Path) -> dict[str, tuple[int, int]]:
    """What changes when a file is written again, even with the same bytes."""
    stats = {path.name: path.stat() for path in folder.iterdir() if path.name != INDEX_NAME}
    return {name: (stat.st_ino, stat.st_mtime_ns) for name, stat in stats.items()}


def test_files_that_are_there_are_not_written_again(tmp_path: Path) -> None:
    folder = tmp_path / "set"
    first, source = wav_recording(tmp_path / "a.wav", 50, scale=16.0, channel=2)
    assert append(folder, RecordingSet([first]), [source]) == 1
    assert append(folder, RecordingSet([recording(100)]), [None]) == 2
    before = identities(folder)
    last, source = wav_recording(tmp_path / "b.wav", 150)
    assert append(folder, RecordingSet([last]), [source]) == 3
    after = identities(folder)
    assert after.pop("0003.wav")
    assert after == before
    assert set(after) == {"0001.wav", "0002.csv"}
    assert (folder / "0001.wav").read_bytes() == (tmp_path / "a.wav").read_bytes()
    assert RecordingSet.load(folder) == RecordingSet([first, recording(100), last])


def test_a_set_that_was_saved_grows_and_loads_back(tmp_path: Path) -> None:
    RecordingSet([recording(50), recording(100)]).save(tmp_path / "set")
    made, source = wav_recording(tmp_path / "a.wav", 150, scale=0.1, channel=3)
    append(tmp_path / "set", RecordingSet([made]), [source])
    assert RecordingSet.load(tmp_path / "set") == RecordingSet(
        [recording(50), recording(100), made]
    )
    header, *rows = (tmp_path / "set" / INDEX_NAME).read_text().splitlines()
    assert header.split("\t")[-2:] == ["g_per_fullscale", "channel"]
    assert rows[0].endswith("\t\t")
    assert rows[2].endswith("\t0.1\t3")
    RecordingSet.load(tmp_path / "set").save(tmp_path / "set")  # CSV, for exchange
    assert set(contents(tmp_path / "set")) == {INDEX_NAME, "0001.csv", "0002.csv", "0003.csv"}


def test_a_list_of_ones_own_keeps_its_rows(tmp_path: Path) -> None:
    """Without the columns that rows of CSV files have."""
    made, source = wav_recording(tmp_path / "mine.wav", 50)
    table = "file\ttexture\tspeed_mm_s\tforce_n\tchannel\tmood\nmine.wav\tfelt\t50\t1\t1\tgood\n"
    (tmp_path / INDEX_NAME).write_text(table)
    append(tmp_path, RecordingSet([recording(100)]), [None])
    assert RecordingSet.load(tmp_path) == RecordingSet([made, recording(100)])
    text = (tmp_path / INDEX_NAME).read_text()
    assert text.splitlines()[1].startswith("mine.wav\tfelt\t50\t1\t1\tgood\t")
    assert source.path.is_file()


def test_a_condition_that_the_set_holds_is_refused(tmp_path: Path) -> None:
    append(tmp_path / "set", RecordingSet([recording(50), recording(100)]), [None, None])
    before = contents(tmp_path / "set")
    with refused(InputError, expected="condition", got=["felt", "100 mm/s", "1 N"]):
        append(tmp_path / "set", RecordingSet([recording(100)]), [None])
    assert contents(tmp_path / "set") == before


def test_a_condition_that_differs_by_rounding_is_refused(tmp_path: Path) -> None:
    """Such a set could not be loaded any more."""
    append(tmp_path / "set", RecordingSet([recording(50), recording(100)]), [None, None])
    before = contents(tmp_path / "set")
    with refused(InputError, names="'felt'", expected="rounding", got=["50.0", "50.000001"]):
        append(tmp_path / "set", RecordingSet([recording(50.000001)]), [None])
    assert contents(tmp_path / "set") == before


def test_files_of_others_keep_their_names(tmp_path: Path) -> None:
    append(tmp_path / "set", RecordingSet([recording(50)]), [None])
    (tmp_path / "set/0002.csv").write_text("mine")
    append(tmp_path / "set", RecordingSet([recording(100)]), [None])
    assert (tmp_path / "set/0002.csv").read_text() == "mine"
    assert len(RecordingSet.load(tmp_path / "set")) == 2
    (tmp_path / "other").mkdir()
    (tmp_path / "other/notes.txt").write_text("mine")
    with refused(InputError, got=[tmp_path / "other", "notes.txt"]):
        append(tmp_path / "other", RecordingSet([recording(100)]), [None])
    assert contents(tmp_path / "other") == {"notes.txt": b"mine"}


@pytest.mark.parametrize("exists", [True, False])
def test_a_full_disk_changes_nothing(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, exists: bool
) -> None:
    folder = tmp_path / "set"
    if exists:
        append(folder, RecordingSet([recording(50)]), [None])
    before = contents(folder) if exists else {}
    made, source = wav_recording(tmp_path / "a.wav", 150)

    def no_space(source: Path, target: Path) -> None:
        target.write_bytes(source.read_bytes()[:100])
        raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC), str(target))

    monkeypatch.setattr(shutil, "copyfile", no_space)
    with refused(InputError, expected=folder, got="disk"):
        append(folder, RecordingSet([recording(100), made]), [None, source])
    assert folder.is_dir() == exists
    assert (contents(folder) if exists else {}) == before
    assert not list(tmp_path.glob(".*"))


KILLED = """
import os, shutil, signal, sys
from pathlib import Path
from tactileq.modeling import RecordingSet
from tactileq.modeling.recordings import appending, recording_set
die = lambda *_: os.kill(os.getpid(), signal.SIGKILL)
step, folder, other = sys.argv[1:]
def half(source, target):
    Path(target).write_bytes(Path(source).read_bytes()[:100])
    die()
if step == "copying": shutil.copyfile = half
if step == "before the index": appending.write_files = die
if step == "after the index": appending._remove_unfinished = lambda f: (f / "0001.csv").exists() \\
    and (f / "0003.wav").exists() and die()
records = RecordingSet.load(other)
source = appending.WavSource(Path(other) / "0001.wav", 2)
appending.append(folder, records, [source])
"""


@pytest.mark.parametrize("step", ["copying", "before the index", "after the index"])
def test_a_killed_addition_leaves_the_set_and_nothing_for_good(tmp_path: Path, step: str) -> None:
    folder, other = tmp_path / "set", tmp_path / "other"
    append(folder, RecordingSet([recording(50), recording(100)]), [None, None])
    made, source = wav_recording(tmp_path / "a.wav", 150, channel=2)
    append(other, RecordingSet([made]), [source])
    child = subprocess.run([sys.executable, "-c", KILLED, step, folder, other], timeout=500)
    assert child.returncode == -signal.SIGKILL
    assert (folder / UNFINISHED_NAME).is_file() == (step != "copying")
    known = [recording(50), recording(100)]
    known += [made] if step == "after the index" else []
    assert RecordingSet.load(folder) == RecordingSet(known)
    append(folder, RecordingSet([recording(200)]), [None])  # of another kind: no name is taken over
    assert RecordingSet.load(folder) == RecordingSet([*known, recording(200)])
    files = {path.name for path in folder.iterdir()}
    third = {"0003.wav", "0004.csv"} if step == "after the index" else {"0003.csv"}
    assert files == {INDEX_NAME, "0001.csv", "0002.csv"} | third
