"""A loss of power, and damage, cost no piece and no recording beside what is damaged."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from tactileq.modeling import InputError, RecordingSet
from tactileq.rig.recording.capture.pieces import PieceStore
from tests.power_cut import laid_out, watched
from tests.refusals import refused
from tests.rig.recording.capture.test_pieces import piece, plan

SECONDS = (0.0, 0.2, 0.38, 0.5)  # of one condition, after so many pieces


def test_without_power_what_was_kept_is_there(tmp_path: Path) -> None:
    (tmp_path / "disk").mkdir()
    with watched(tmp_path / "disk") as disk:
        store = PieceStore(tmp_path / "disk/oak", plan())
        for number in range(3):
            store.add(piece(seed=number))
            disk.told = number + 1
    assert len(disk.cuts) > 60
    for number, (files, told) in enumerate(disk.cuts):
        folder = laid_out(files, tmp_path / f"cut-{number}") / "oak"
        again = PieceStore(folder, plan())
        # One that was not kept yet may be there without its table.
        assert again.damaged == [] or told == 0
        assert again.coverage.seconds.ravel()[0] in SECONDS[told : told + 2]
        if told == 3:
            assert [record.samples.size for record in RecordingSet.load(folder)] == [1000]


def test_a_damaged_piece_costs_that_piece_and_no_name_is_given_twice(tmp_path: Path) -> None:
    folder = tmp_path / "oak"
    store = PieceStore(folder, plan(wanted_s=2.0))
    for number in range(3):
        store.add(piece(seed=number))
    kept = {path.name: path.read_bytes() for path in (folder / "pieces").glob("*.wav")}
    (folder / "pieces/00001.wav").write_bytes(b"")
    (folder / "pieces/00003.wav").write_bytes(kept["00003.wav"][:-800])
    again = PieceStore(folder, plan(wanted_s=2.0))
    assert again.coverage.seconds.ravel() == pytest.approx([0.2, 0.0])
    assert [name in told for name, told in zip(("00001", "00003"), again.damaged, strict=True)]
    (folder / "pieces/pieces.tsv").unlink()
    without = PieceStore(folder, plan(wanted_s=2.0))
    assert not without.coverage.seconds.any()
    assert "3 that it does not list, such as 00001.wav" in without.damaged[0]
    without.add(piece(seed=3))
    assert (folder / "pieces/00002.wav").read_bytes() == kept["00002.wav"]
    assert (folder / "pieces/00004.wav").is_file()


def test_without_the_index_recordings_are_made_again_beside_the_old(tmp_path: Path) -> None:
    folder = tmp_path / "oak"
    store = PieceStore(folder, plan())
    for number in range(3):
        store.add(piece(seed=number))
    before = (folder / "0001.wav").read_bytes()
    (record,) = RecordingSet.load(folder)
    (folder / "0001.wav").write_bytes(before[:-100])
    assert "0001.wav" in PieceStore(folder, plan()).damaged[0]
    (folder / "0001.wav").write_bytes(before)
    (folder / "recordings.tsv").unlink()
    again = PieceStore(folder, plan())
    assert "expected recordings.tsv beside 0001.wav" in again.damaged[0]
    assert (folder / "0001.wav").read_bytes() == before
    (made,) = RecordingSet.load(folder)
    assert np.array_equal(made.samples, record.samples)


@pytest.mark.parametrize(
    ("name", "left", "got"),
    [
        ("recordings.tsv", 0, "empty"),
        ("pieces/pieces.tsv", 0, "empty"),
        ("pieces/pieces.tsv", -3, r"\tfal'"),
    ],
)
def test_a_table_that_was_cut_is_named_and_nothing_is_written(
    tmp_path: Path, name: str, left: int, got: str
) -> None:
    folder = tmp_path / "oak"
    PieceStore(folder, plan()).add(piece())
    (folder / name).write_bytes((folder / name).read_bytes()[:left])
    before = {path: path.read_bytes() for path in folder.rglob("*") if path.is_file()}
    with refused(InputError, expected=folder / name, got=got):
        PieceStore(folder, plan())
    assert before == {path: path.read_bytes() for path in folder.rglob("*") if path.is_file()}
