"""Memory that processes share: rings of readings and blocks, one writer, any readers."""

from __future__ import annotations

import subprocess
import sys
from contextlib import ExitStack
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from tactileq.modeling import InputError
from tactileq.modeling.errors import shown
from tactileq.rig.shared.live import memory as live_memory
from tactileq.rig.shared.live.clock import now_s
from tactileq.rig.shared.live.compiled import compiled
from tactileq.rig.shared.live.memory import BLOCK, CONTACT, READING, Live
from tests.refusals import refused

ROOT = Path(__file__).parents[4]
RING = 16384
WRITER = """
import sys
from tactileq.rig.shared.live.memory import Live
live = Live.attach(sys.argv[1])
for n in range(int(sys.argv[2])):
    live.write_reading(n, n, y_mm=n, speed_mm_s=n, force_n=n, flags=n % 32)
"""


def write(live: Live, first: int, count: int) -> None:
    for n in range(first, first + count):
        live.write_reading(n, 2.0 * n, y_mm=3.0 * n, speed_mm_s=-n, force_n=0.5, flags=n % 32)


def test_rows_have_the_layout_of_the_header() -> None:
    ffi = compiled().ffi
    for name, kind in (("tq_reading", READING), ("tq_block", BLOCK)):
        fields = dict(ffi.typeof(name).fields)
        assert list(fields) == list(kind.names or ())
        assert ffi.sizeof(name) == kind.itemsize
        assert [fields[key].offset for key in fields] == [
            kind.fields[key][1] for key in kind.names or () if kind.fields is not None
        ]


def test_the_memory_of_a_killed_maker_goes_with_the_next_one() -> None:
    making = (
        "import sys\nfrom tactileq.rig.shared.live.memory import Live\nwith Live.create() as live: "
    )
    told = [making + "print(live.path, flush=True); sys.stdin.read()"]
    pipes = {"stdin": subprocess.PIPE, "stdout": subprocess.PIPE}
    with ExitStack() as stack:
        makers = [
            stack.enter_context(
                subprocess.Popen([sys.executable, "-c", *told], cwd=ROOT, text=True, **pipes)
            )
            for _ in range(2)
        ]
        living, killed = (Path(maker.stdout.readline().strip()) for maker in makers)
        assert killed.exists()
        makers[1].kill()
        makers[1].wait()
        with Live.create() as live:
            assert not list(killed.parent.glob(f"{killed.name}*"))
            assert living.exists()
            assert live.path.exists()
        assert not list(live.path.parent.glob(f"{live.path.name}*"))
    assert not list(living.parent.glob(f"{living.name}*"))


def test_a_reading_is_read_by_another_who_attaches() -> None:
    with Live.create() as live, Live.attach(live.path) as other:
        assert other.latest() is None
        assert other.readings_written == 0
        live.write_reading(1.5, np.nan, y_mm=-2.0, speed_mm_s=-120.0, force_n=1.25, flags=CONTACT)
        row = other.latest()
        assert row is not None
        assert np.isnan(row["x_mm"])
        assert [float(row[name]) for name in ("time_s", "y_mm", "speed_mm_s", "force_n")] == [
            1.5,
            -2.0,
            -120.0,
            1.25,
        ]
        assert row["flags"] == CONTACT


@given(pieces=st.lists(st.integers(0, 40), max_size=12), asked=st.integers(0, 600))
def test_who_asks_gets_what_came_since(pieces: list[int], asked: int) -> None:
    with Live.create() as live:
        seen = written = 0
        for piece in pieces:
            write(live, written, piece)
            written += piece
            seen, rows = live.readings_since(seen)
            assert seen == written
            assert rows["time_s"].tolist() == list(range(written - piece, written))
        count, rows = live.readings_since(asked)
        assert count == written
        assert rows["time_s"].tolist() == list(range(min(asked, written), written))


def test_what_nobody_asked_for_in_time_is_left_out_and_the_count_tells() -> None:
    with Live.create() as live:
        write(live, 0, RING + 100)
        count, rows = live.readings_since(0)
        assert count == RING + 100
        assert rows.size == RING - 1
        assert rows["time_s"][0] == 101
        assert rows["time_s"][-1] == RING + 99


def test_no_reader_sees_half_a_row_of_a_writer_that_races_ahead() -> None:
    with Live.create() as live:
        command = [sys.executable, "-c", WRITER, str(live.path), str(20 * RING)]
        writer = subprocess.Popen(command)
        seen = latest = 0
        while writer.poll() is None:
            before = seen
            seen, rows = live.readings_since(seen)
            numbers = rows["time_s"]
            for name in ("x_mm", "y_mm", "speed_mm_s", "force_n"):
                np.testing.assert_array_equal(rows[name], numbers)
            np.testing.assert_array_equal(rows["flags"], numbers % 32)
            np.testing.assert_array_equal(numbers, np.arange(seen - rows.size, seen))
            assert seen - rows.size >= before
            row = live.latest()
            if row is not None:
                assert row["time_s"] == row["force_n"] >= latest
                latest = row["time_s"]
        assert writer.returncode == 0
        assert live.readings_written == 20 * RING


def test_a_reader_who_is_overtaken_gets_no_row_under_way(tmp_path: Path) -> None:
    """At every load of a copy in turn: a row and a half are written there (overtaken.c)."""
    program = tmp_path / "overtaken"
    source, headers = Path(__file__).with_name("overtaken.c"), Path(live_memory.__file__).parent
    command = ["gcc", "-std=gnu11", "-O1", f"-I{headers}", str(source), "-o", str(program)]
    subprocess.run(command, check=True)
    told = subprocess.run([program], check=True, capture_output=True, text=True).stdout
    moments, fewest, most, torn = map(int, told.split())
    assert moments == 4 * 7 + 2  # of four rows of seven words, and the count before and after
    assert (fewest, most) == (3, 4)
    assert torn == 0


def test_the_file_is_gone_with_who_made_it() -> None:
    live = Live.create()
    other = Live.attach(live.path)
    other.close()
    assert live.path.exists()
    live.close()
    live.close()
    assert not live.path.exists()


@pytest.mark.parametrize("size", [0, 100, None])
def test_another_file_is_refused(tmp_path: Path, size: int | None) -> None:
    path = tmp_path / "memory"
    with Live.create() as live:
        length = live.path.stat().st_size if size is None else size
    path.write_bytes(bytes(length))
    with refused(InputError, expected=["memory", shown(str(path))]):
        Live.attach(path)


def test_the_clock_is_the_same_in_every_process() -> None:
    before = now_s()
    command = [
        sys.executable,
        "-c",
        "from tactileq.rig.shared.live.clock import now_s; print(now_s())",
    ]
    there = float(subprocess.run(command, capture_output=True, text=True, check=True).stdout)
    assert before < there < now_s()


def test_without_compiled_parts_it_says_what_to_install(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("tactileq.rig.shared.live.compiled._live", None)
    with refused(InputError, expected="compiled", got=["none", "C compiler"]):
        Live.create()
