"""What is read, what is refused, and in which words."""

from __future__ import annotations

import os
from pathlib import Path

import numpy as np
import pytest

from tactileq.modeling import InputError
from tactileq.modeling.errors import shortened, shown
from tactileq.modeling.files.columns import Column
from tactileq.modeling.files.documents import read_json_object, read_toml
from tactileq.modeling.files.reading import check_file, read_bytes, read_text, reason_of
from tactileq.modeling.files.tables import csv_cells, read_table
from tests.refusals import refused


def test_text_is_read_without_its_mark_and_with_one_kind_of_line_end(tmp_path: Path) -> None:
    path = tmp_path / "a.txt"
    path.write_bytes(b"\xef\xbb\xbfa\r\nb\rc\nd")
    assert read_text(path, "a text") == "a\nb\nc\nd"
    assert read_bytes(path, "a text")[:4] == b"\xef\xbb\xbfa"
    (tmp_path / "link.txt").symlink_to("a.txt")
    assert read_text(tmp_path / "link.txt", "a text") == "a\nb\nc\nd"


@pytest.mark.parametrize(
    ("name", "got"),
    [
        ("none", "nothing there"),
        ("a.txt/b", "nothing there"),
        ("", "a folder"),
        ("pipe", "a pipe, a socket or a device"),
        ("loop", "a link that points back to itself"),
        ("x" * 5000, "a name that is too long"),
        ("a\0b", "a name that no file can have"),
    ],
)
def test_what_is_no_file_is_refused_before_it_is_opened(
    tmp_path: Path, name: str, got: str
) -> None:
    (tmp_path / "a.txt").write_text("a")
    os.mkfifo(tmp_path / "pipe")
    (tmp_path / "loop").symlink_to("loop")
    for read in (check_file, read_bytes, read_text):
        with pytest.raises(InputError) as caught:
            read(tmp_path / name, "a recipe")
        assert str(caught.value).endswith(f"got {got}; give its path.")
        assert str(caught.value).startswith("expected a recipe at /")
        assert len(str(caught.value)) < 300


def test_what_the_system_refuses_is_told_in_words(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def refuse(path: Path) -> bytes:
        raise PermissionError(13, os.strerror(13), str(path))

    (tmp_path / "a.txt").write_text("a")
    monkeypatch.setattr(Path, "read_bytes", refuse)
    with refused(InputError, expected=tmp_path / "a.txt", got="permission"):
        read_text(tmp_path / "a.txt", "a text")
    assert reason_of(OSError(28, os.strerror(28))) == "a full disk"
    assert reason_of(OSError(5000, "Strange")) == "the refusal Strange"


def test_marks_are_read_in_documents_and_tables(tmp_path: Path) -> None:
    mark = b"\xef\xbb\xbf"
    path = tmp_path / "file"
    path.write_bytes(mark + b'{"a": 1}')
    assert read_json_object(path, advice="mend it") == {"a": 1}
    path.write_bytes(mark + b"a = 1\r\n")
    assert read_toml(path, "a recipe") == {"a": 1}
    path.write_bytes(mark + b"a\tb\r\n1\t2\r\n")
    assert read_table(path, [Column("a"), Column("b")]) == [{"a": "1", "b": "2"}]


def test_numbers_at_the_edge_are_read(tmp_path: Path) -> None:
    path = tmp_path / "file"
    path.write_text('{"a": [1' + "0" * 308 + ", 1e400, true]}")
    assert read_json_object(path, advice="mend it") == {"a": [10**308, np.inf, True]}
    path.write_text("a = [1" + "0" * 309 + "]")
    with refused(InputError, expected=["TOML", path], got="number"):
        read_toml(path, "a recipe")


def test_a_column_has_one_name(tmp_path: Path) -> None:
    (tmp_path / "t.tsv").write_text("a\tb\ta\n1\t2\t3\n")
    with pytest.raises(InputError, match="each column once in .*, got 'a' twice"):
        read_table(tmp_path / "t.tsv", [Column("a")])


def test_cells_and_quotes() -> None:
    assert csv_cells("a\tb\t", "line 1") == ["a", "b", ""]
    assert csv_cells('"a,""b"""\tc', "line 1") == ['a,"b"', "c"]
    for line in ('a\t"b', 'a\t"b"c', '"' + "a" * 200_000):
        with refused(InputError, expected=["quotes", "line 7"], got=shown(line)) as caught:
            csv_cells(line, "line 7")
        assert len(str(caught.value)) < 200


def test_quotes_in_messages() -> None:
    assert shown("canvas") == "'canvas'"
    assert shown(np.float64(2.0)) == "2.0"
    assert shown([np.int64(3), np.bool_(True)]) == "[3, True]"
    assert shown(np.array([1.5, 2.0])) == "[1.5, 2.0]"
    assert shown("a\nb") == "'a\\nb'"
    for value in ("x" * 10**6, 10**4000, ["y" * 1000] * 1000, {"z" * 100: 1}):
        assert len(shown(value)) <= 60
    deep: list[object] = []
    for _ in range(100_000):
        deep = [deep]
    assert len(shown(deep)) <= 60
    assert shortened("two\nlines") == "two lines"
    assert shortened("x" * 100) == "x" * 59 + "…"
    assert shortened(" " * 1000 + "x") == "…"


@pytest.mark.parametrize(
    ("text", "line", "point"),
    [
        ("name = 'x'\nlongest_gap_min = 0,5\n", 2, "0.5"),
        ("longest_gap_min=0,5 # a comment", 1, "0.5"),
        ("a = 1\r\nb = -1_000,25\r\nc = 1\r\n", 2, "-1_000.25"),
        ("a = 1,5e3", 1, "1.5e3"),
        ('[sound]\n\npeak = { value = 0,5, unit = "g" }', 3, "0.5"),
        ("peak = { unit = 'g', value = 2,25 }", 1, "2.25"),
        ("a = [\n  { value = 0,5 },\n]", 2, "0.5"),
    ],
)
def test_a_decimal_comma_is_called_so(tmp_path: Path, text: str, line: int, point: str) -> None:
    path = tmp_path / "study.toml"
    path.write_bytes(text.encode())
    with refused(
        InputError, names=path, expected="TOML", got=["decimal comma", f"line {line}", point]
    ):
        read_toml(path, "a study file")


@pytest.mark.parametrize(
    "text",
    [
        "a = [0,5]",
        "a = [\n  0,5,\n  1,5,\n]",
        "a = { x = 1,5 = 3 }",
        "a = '= 0,5'\nb = 0.5  # not = 0,5",
        'a = """\nb = 0,5\n"""',
    ],
)
def test_commas_of_lists_tables_and_texts_are_none(tmp_path: Path, text: str) -> None:
    path = tmp_path / "study.toml"
    path.write_text(text)
    assert read_toml(path, "a study file")


@pytest.mark.parametrize(
    ("text", "line"),
    [
        ("a = '= 0,5'\nb = ", None),
        ("a = 0.5\nb = [1,2] 3", 2),
        ("a = { x = 1, y = }", 1),
        ("a = 1, b = 2", 1),
        ("a = '0,5", None),
        ("# a = 0,5\nb = 2 3 # = 0,5", 2),
    ],
)
def test_what_else_is_no_toml_is_said_with_its_line(
    tmp_path: Path, text: str, line: int | None
) -> None:
    path = tmp_path / "study.toml"
    path.write_text(text)
    facts = "something else" if line is None else f"line {line}"
    with refused(InputError, expected=["TOML", path], got=facts) as caught:
        read_toml(path, "a study file")
    assert "decimal" not in str(caught.value)
