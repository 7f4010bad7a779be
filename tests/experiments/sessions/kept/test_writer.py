"""The thread that writes a log: what it says is safe is on disk, whatever the disk refuses."""

from __future__ import annotations

import errno
import json
import os
import tempfile
from collections.abc import Callable
from contextlib import suppress
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from tactileq.experiments.sessions.kept.files import open_file
from tactileq.experiments.sessions.kept.writer import LogWriter, StoreError

SENTENCES = {
    errno.EIO: "a disk that fails",
    errno.ENOSPC: "a full disk",
    errno.EDQUOT: "the refusal Disk quota exceeded",
}


def writer_of(path: Path) -> LogWriter:
    return LogWriter(open_file(path, new=True), path, first=1)


def failing(number: int, at: int, *, for_good: bool) -> Callable[[int], None]:
    """An fsync that fails at this call, counted from 1, and at all later ones or not."""
    real, calls = os.fsync, [0]

    def fsync(handle: int) -> None:
        calls[0] += 1
        if calls[0] == at or (for_good and calls[0] > at):
            raise OSError(number, os.strerror(number))
        real(handle)

    return fsync


def numbers_in(path: Path) -> list[int]:
    text = path.read_text()
    assert text == "" or text.endswith("\n")
    events = [json.loads(line) for line in text.splitlines()]
    assert [event["n"] for event in events] == list(range(1, len(events) + 1))
    return [event["value"] for event in events]


@pytest.mark.parametrize("for_good", [True, False])
@pytest.mark.parametrize("number", SENTENCES)
def test_what_an_fsync_refused_does_not_count_and_nothing_before_it_is_lost(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, number: int, for_good: bool
) -> None:
    path = tmp_path / "log.jsonl"
    writer = writer_of(path)
    monkeypatch.setattr(os, "fsync", failing(number, 3, for_good=for_good))
    for value in (1, 2):
        writer.put_safely({"value": value})
    with pytest.raises(StoreError) as refused:
        writer.put_safely({"value": 3})
    sentence = (
        f"expected to write to {path}, got {SENTENCES[number]}; what was answered before is safe: "
        "free disk space, then continue with --resume."
    )
    assert str(refused.value) == sentence
    assert numbers_in(path) == [1, 2]
    # It may have said so only once, while it lost what it had taken: nothing more is trusted to it.
    for again in (lambda: writer.put({}), lambda: writer.put_safely({}), writer.close):
        with pytest.raises(StoreError) as refused:
            again()
        assert str(refused.value) == sentence
    assert numbers_in(path) == [1, 2]


steps = st.lists(st.booleans(), min_size=1, max_size=30)  # whether one waits for it


@given(steps, st.integers(1, 12), st.booleans(), st.sampled_from(sorted(SENTENCES)))
def test_all_that_was_acknowledged_is_there_and_nothing_that_was_refused(
    waits: list[bool], at: int, for_good: bool, number: int
) -> None:
    with tempfile.TemporaryDirectory() as folder, pytest.MonkeyPatch.context() as broken:
        path = Path(folder) / "log.jsonl"
        writer = writer_of(path)
        broken.setattr(os, "fsync", failing(number, at, for_good=for_good))
        safe, refused = 0, False
        try:
            for value, wait in enumerate(waits, start=1):
                if wait:
                    writer.put_safely({"value": value})
                    safe = value
                else:
                    writer.put({"value": value})
            writer.close()
            safe = len(waits)
        except StoreError:
            refused = True
            with suppress(StoreError):  # where it was not closing that was refused
                writer.close()
        there = numbers_in(path)
        assert there == list(range(1, len(there) + 1))
        assert safe <= len(there)
        assert refused == (len(there) < len(waits))
