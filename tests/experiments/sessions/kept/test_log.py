"""The log: what is written reads back equal, half a line is no line, all else is refused."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from tactileq.experiments.sessions.kept.log import line_of, read_log
from tactileq.modeling import InputError
from tests.refusals import refused

TEXTS = st.text(st.characters(), max_size=30)  # halves of surrogate pairs among them
VALUES = st.recursive(
    st.none()
    | st.booleans()
    | st.integers()
    | st.floats(allow_nan=False, allow_infinity=False)
    | TEXTS,
    lambda inner: st.lists(inner, max_size=4) | st.dictionaries(TEXTS, inner, max_size=4),
    max_leaves=12,
)
OPENED = {"event": "opened", "manifest_sha256": "aa"}
LINE = {"n": 1, "utc": "2026-11-22T09:30:00.125Z", "t_s": 0.5, "run": 1, "event": "phase"}


def written(path: Path, *lines: dict[str, object], cut: bytes = b"") -> Path:
    path.write_bytes(b"".join(line_of({"n": n, **line}) for n, line in enumerate(lines, 1)) + cut)
    return path


def event(**changed: object) -> dict[str, object]:
    return {**{key: value for key, value in LINE.items() if key != "n"}, **changed}


@given(st.dictionaries(TEXTS, VALUES, max_size=5))
def test_any_values_come_back_equal_from_one_line(values: dict[str, object]) -> None:
    line = line_of(values)
    assert line.endswith(b"\n")
    assert line.count(b"\n") == 1
    assert json.loads(line.decode("utf-8")) == values


def test_what_json_has_no_word_for() -> None:
    values = {
        "nan": float("nan"),
        "inf": [float("-inf"), np.float64("nan")],
        "array": np.array([1.5, np.nan]),
        "n": np.int64(3),
        "yes": np.bool_(True),
        "path": Path("data"),
        "pair": (1, 2),
        4: "key",
    }
    assert json.loads(line_of(values)) == {
        "nan": None,
        "inf": [None, None],
        "array": [1.5, None],
        "n": 3,
        "yes": True,
        "path": "data",
        "pair": [1, 2],
        "4": "key",
    }


def test_it_is_read_as_it_was_written(tmp_path: Path) -> None:
    lines = (event(**OPENED), event(told="zwölf\u2028\x85"), event(event="answer", row={}))
    log = read_log(written(tmp_path / "log", *lines))
    assert [e["event"] for e in log.events] == ["opened", "phase", "answer"]
    assert log.events[1]["told"] == "zwölf\u2028\x85"
    assert log.cut == b""


def test_wherever_the_last_line_is_cut_the_lines_before_it_are_read(tmp_path: Path) -> None:
    whole = line_of({**LINE, "n": 2, "told": "ü"})
    for end in range(len(whole)):
        log = read_log(written(tmp_path / "log", event(**OPENED), cut=whole[:end]))
        assert len(log.events) == 1
        assert log.cut == whole[:end]


def test_a_tail_of_zeros_as_after_a_loss_of_power_is_no_line(tmp_path: Path) -> None:
    log = read_log(written(tmp_path / "log", event(**OPENED), cut=b'{"n": 2' + bytes(500)))
    assert len(log.events) == 1


@pytest.mark.parametrize(
    "line",
    [
        b"\n",
        b"\x00\x00\n",
        b"[1]\n",
        b"\xff\n",
        b'{"n": 2, "event": "phase"}\n',
        line_of({**LINE, "n": 3}),
        line_of({**LINE, "n": 2, "utc": "yesterday"}),
        line_of({**LINE, "n": 2, "utc": "9999-12-31T23:59:59Z"}),
        line_of({**LINE, "n": 2, "t_s": -1.0}),
        line_of({**LINE, "n": 2, "run": 2}),
        line_of({**LINE, "n": 2, "start_s": "soon"}),
        line_of({**LINE, "n": 2, "event": "answer", "row": None}),
        line_of({**LINE, "n": 2, "event": "ended", "status": "complxte"}),
        line_of({**LINE, "n": 2})[:-2] + b', "x": NaN}\n',
        line_of({**LINE, "n": 2})[:-2] + b', "x": 1e400}\n',
        line_of({**LINE, "n": 2})[:-2] + b', "x": ' + b"9" * 310 + b"}\n",
        line_of({**LINE, "n": 2})[:40] + b"\n",
        b"[" * 100_000 + b"\n",
    ],
)
def test_a_whole_line_that_is_no_event_is_named(tmp_path: Path, line: bytes) -> None:
    path = written(tmp_path / "log", event(**OPENED), cut=line)
    with refused(InputError, expected=["line 2", path]) as told:
        read_log(path)
    assert len(str(told.value)) < 400
    assert "\n" not in str(told.value)


def test_a_lost_line_is_noticed(tmp_path: Path) -> None:
    path = written(tmp_path / "log", event(**OPENED), event(), event())
    lines = path.read_bytes().splitlines(keepends=True)
    path.write_bytes(lines[0] + lines[2])
    with refused(InputError, expected=["line 2", path], got="n = 3"):
        read_log(path)


def test_a_log_that_is_not_there(tmp_path: Path) -> None:
    with refused(InputError, names=["log", tmp_path / "none"]):
        read_log(tmp_path / "none")
