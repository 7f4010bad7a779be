"""Small tables and whole files."""

from __future__ import annotations

from pathlib import Path

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from modeling import InputError
from modeling.files import file_stem, read_table, replace_folder, write_table, write_text


@pytest.mark.parametrize(
    ("name", "stem"),
    [
        ("wall paper", "wall-paper"),
        ("no_7-b.2", "no_7-b.2"),
        ("été/../x", "été-..-x"),
        ("..", "--"),
    ],
)
def test_a_name_becomes_a_file_name(name: str, stem: str) -> None:
    assert file_stem(name) == stem


@given(st.text())
def test_no_name_leads_out_of_its_folder(name: str) -> None:
    folder = Path("/folder")
    assert (folder / file_stem(name)).parent == folder
    assert file_stem(name) not in ("", ".", "..")


cells = st.text(
    st.characters(exclude_categories=["Cs"], exclude_characters="\t\r\n"), min_size=1, max_size=8
)


@settings(deadline=None, max_examples=50)
@given(rows=st.lists(st.tuples(cells, cells), max_size=4))
def test_tables_load_back_equal(
    rows: list[tuple[str, str]], tmp_path_factory: pytest.TempPathFactory
) -> None:
    path = tmp_path_factory.mktemp("table") / "table.tsv"
    numbered = [(f"{n}", *row) for n, row in enumerate(rows)]
    write_table(path, ("number", "a", "b"), numbered)
    expected = [dict(zip(("number", "a", "b"), row, strict=True)) for row in numbered]
    assert read_table(path, ("a",)) == expected
    assert b"\r" not in path.read_bytes()


@pytest.mark.parametrize("cell", ["a\tb", "a\nb", "a\rb"])
def test_cells_that_would_break_the_table_are_refused(tmp_path: Path, cell: str) -> None:
    with pytest.raises(InputError, match="without tabs and line ends"):
        write_table(tmp_path / "t.tsv", ("x",), [(cell,)])
    assert not list(tmp_path.iterdir())


def test_tables_from_other_programs_are_read(tmp_path: Path) -> None:
    path = tmp_path / "t.tsv"
    path.write_bytes("# a note\r\nx\ty\r\n1\tä\r\n\r\n".encode("utf-8-sig"))
    assert read_table(path, ("x", "y")) == [{"x": "1", "y": "ä"}]


def test_failed_writing_leaves_nothing(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def full_disk(*_: object) -> None:
        raise OSError("disk full")

    monkeypatch.setattr("os.replace", full_disk)
    with pytest.raises(OSError, match="disk full"):
        write_text(tmp_path / "a.txt", "text")
    assert not list(tmp_path.iterdir())


def test_folder_appears_whole_or_not_at_all(tmp_path: Path) -> None:
    target = tmp_path / "deep" / "folder"
    with pytest.raises(ZeroDivisionError), replace_folder(target) as fresh:
        (fresh / f"half {1 / 0}").write_text("x")
    assert not list((tmp_path / "deep").iterdir())
    for content in ("first", "second"):
        with replace_folder(target) as fresh:
            assert not target.exists() or (target / "first").is_file()
            (fresh / content).write_text("x")
        assert [p.name for p in target.iterdir()] == [content]
    assert [p.name for p in (tmp_path / "deep").iterdir()] == ["folder"]
