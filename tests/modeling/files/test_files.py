"""Small tables and whole files."""

from __future__ import annotations

import errno
from pathlib import Path

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from tactileq.modeling import InputError
from tactileq.modeling.files.columns import Column
from tactileq.modeling.files.documents import read_json_object
from tactileq.modeling.files.folders import check_replaceable, listed_file, replace_folder
from tactileq.modeling.files.tables import read_table, write_table
from tactileq.modeling.files.writing import file_stem, write_text
from tests.refusals import refused, warned


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
    columns = [Column("number", limits=(0, 4), whole=True), Column("a"), Column("b")]
    expected = [{"number": n, "a": a, "b": b} for n, (a, b) in enumerate(rows)]
    write_table(path, columns, expected)
    assert read_table(path, columns) == expected
    assert b"\r" not in path.read_bytes()


@pytest.mark.parametrize("cell", ["a\tb", "a\nb", "a\rb"])
def test_cells_that_would_break_the_table_are_refused(tmp_path: Path, cell: str) -> None:
    with refused(InputError, expected="cells", got=[[cell]]):
        write_table(tmp_path / "t.tsv", [Column("x")], [{"x": cell}])
    assert not list(tmp_path.iterdir())


def test_tables_from_other_programs_are_read(tmp_path: Path) -> None:
    path = tmp_path / "t.tsv"
    path.write_bytes("# a note\r\nx\ty\r\n1\tä\r\n\r\n".encode("utf-8-sig"))
    assert read_table(path, [Column("x"), Column("y")]) == [{"x": "1", "y": "ä"}]


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


def linked(folder: Path, *, content: str = "old") -> tuple[Path, Path]:
    """A folder elsewhere with one file in it, and a link that leads there."""
    (folder / "disk/sets").mkdir(parents=True)
    (folder / "disk/sets" / content).write_text("x")
    (folder / "link").symlink_to(Path("disk", "sets"))
    return folder / "link", folder / "disk/sets"


def test_a_link_stays_and_what_it_leads_to_is_replaced(tmp_path: Path) -> None:
    link, place = linked(tmp_path)
    with replace_folder(link) as fresh:
        (fresh / "new").write_text("x")
    assert link.is_symlink()
    assert [p.name for p in place.iterdir()] == ["new"]
    assert sorted(p.name for p in tmp_path.iterdir()) == ["disk", "link"]
    assert [p.name for p in (tmp_path / "disk").iterdir()] == ["sets"]


def test_a_file_is_written_through_its_link(tmp_path: Path) -> None:
    (tmp_path / "disk").mkdir()
    (tmp_path / "disk/a.txt").write_text("old")
    (tmp_path / "a.txt").symlink_to("disk/a.txt")
    write_text(tmp_path / "a.txt", "new")
    assert (tmp_path / "a.txt").is_symlink()
    assert (tmp_path / "disk/a.txt").read_text() == "new"
    assert [p.name for p in (tmp_path / "disk").iterdir()] == ["a.txt"]


@pytest.mark.parametrize("to", ["nowhere", "link"])
def test_links_that_lead_nowhere_are_refused(tmp_path: Path, to: str) -> None:
    """Those that lead to themselves, too."""
    (tmp_path / "link").symlink_to(to)
    for write in (
        lambda path: write_text(path, "x"),
        lambda path: replace_folder(path).__enter__(),
        lambda path: check_replaceable(path, index_name="index.tsv", what="a set"),
    ):
        with refused(InputError, got=[tmp_path / "link", f"(to {to})"]):
            write(tmp_path / "link")
    assert [p.name for p in tmp_path.iterdir()] == ["link"]


@pytest.mark.parametrize("name", [".", "..", "../inner", "../../link"])
def test_the_folder_that_one_is_in_is_not_replaced(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, name: str
) -> None:
    (tmp_path / "outer/inner").mkdir(parents=True)
    (tmp_path / "link").symlink_to("outer")
    monkeypatch.chdir(tmp_path / "outer/inner")
    before = sorted(tmp_path.rglob("*"))
    with refused(InputError, expected="folder", got=name):
        replace_folder(name).__enter__()
    with refused(InputError, expected="folder", got=name):
        check_replaceable(Path(name), index_name="index.tsv", what="a set")
    assert sorted(tmp_path.rglob("*")) == before
    with replace_folder("beside"):
        pass
    assert (tmp_path / "outer/inner/beside").is_dir()


def test_an_old_folder_that_stays_does_not_undo_the_new_one(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    link, place = linked(tmp_path)

    def busy(*_: object, **__: object) -> None:
        raise OSError(errno.EBUSY, "Device or resource busy")

    monkeypatch.setattr("os.rmdir", busy)
    with warned(expected=place, got="remove"), replace_folder(link) as fresh:
        (fresh / "new").write_text("x")
    monkeypatch.undo()
    assert [p.name for p in place.iterdir()] == ["new"]
    assert link.is_symlink()


def test_a_folder_that_an_index_lists_is_none_of_its_files(tmp_path: Path) -> None:
    target = tmp_path / "set"
    write_table(target / "index.tsv", [Column("file")], [{"file": "0001.csv"}, {"file": "photos"}])
    (target / "0001.csv").write_text("1\n")
    check_replaceable(target, index_name="index.tsv", what="a set")
    (target / "photos").mkdir()
    with refused(InputError, expected="a set", got=[target, "photos"]):
        check_replaceable(target, index_name="index.tsv", what="a set")


@pytest.mark.parametrize("name", ["../secret", "/dev/../etc/passwd", "a/../../secret"])
def test_an_index_names_no_file_outside_its_folder(tmp_path: Path, name: str) -> None:
    folder = tmp_path / "set"
    (folder / "a").mkdir(parents=True)
    (tmp_path / "secret").write_text("1\n")
    (folder / "own").write_text("1\n")
    (folder / "again").symlink_to("own")
    (folder / "annexed").symlink_to("../secret")  # put there by who keeps the folder
    for own in ("own", "again", "annexed", "a/../own"):
        assert listed_file(folder, own, index_name="index.tsv").read_text() == "1\n"
    with refused(InputError, expected=[folder, "index.tsv"], got=f"'{name}'"):
        listed_file(folder, name, index_name="index.tsv")


@pytest.mark.parametrize("name", [".hid", "../evil", ".", "..", ""])
def test_no_name_gives_a_hidden_file(name: str) -> None:
    assert not file_stem(name).startswith(".")


def test_a_name_twice_in_json_is_refused(tmp_path: Path) -> None:
    path = tmp_path / "x.json"
    path.write_text('{"rate_hz": 5000, "more": {"a": 1, "a": 2}}')
    with refused(InputError, expected=path, got="'a'"):
        read_json_object(path, advice="mend it")
