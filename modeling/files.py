"""Reading and writing small tables and whole files so that nothing half-written remains."""

from __future__ import annotations

import os
import shutil
import tempfile
import tomllib
import warnings
from collections.abc import Collection, Iterable, Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from modeling.errors import InputError


def file_stem(name: str) -> str:
    """A name as a file name: letters, digits and `-_.` stay, all else becomes `-`."""
    kept = "".join(c if c.isalnum() or c in "-_." else "-" for c in name)
    # "", "." and ".." would not be a file in the folder but another folder.
    return kept if kept.strip(".") else "-" * max(len(kept), 1)


def read_toml(path: Path, what: str) -> dict[str, Any]:
    """The contents of a TOML file; InputError naming `what` is expected where it is none."""
    try:
        return tomllib.loads(path.read_text(encoding="utf-8"))
    except OSError as error:
        raise InputError(
            f"expected {what} at {path}, got {error.strerror}; give its path."
        ) from None
    except ValueError as error:
        raise InputError(
            f"expected TOML in {path}, got something else ({error}); correct that line."
        ) from None


def write_text(path: str | Path, text: str) -> None:
    """Write a text file (UTF-8) so that it is there whole or not at all."""
    write_bytes(path, text.encode("utf-8"))


def write_bytes(path: str | Path, data: bytes) -> None:
    """Write a file so that it is there whole or not at all; a link keeps leading to it."""
    target = _behind_links(path)
    target.parent.mkdir(parents=True, exist_ok=True)
    handle, name = tempfile.mkstemp(dir=target.parent, prefix=f".{target.name}.")
    try:
        with os.fdopen(handle, "wb") as file:
            file.write(data)
        os.chmod(name, 0o644)
        os.replace(name, target)
    except BaseException:
        os.unlink(name)
        raise


def _behind_links(path: str | Path) -> Path:
    """Where something written to `path` belongs: what a link leads to, so that the link stays."""
    target = Path(path)
    if not target.is_symlink():
        return target
    if not target.exists():
        raise InputError(
            f"expected a place to write to, got the link {target}, which leads nowhere (to "
            f"{target.readlink()}); make what it leads to, or remove it."
        )
    return target.resolve()


def folder_behind(path: str | Path) -> Path:
    """The folder that `replace_folder` would replace, behind links.

    Raises
    ------
    InputError
        For a link that leads nowhere, and for a folder that this process is in: a program that
        stands in a folder is left in the old one when that is replaced.
    """
    target = _behind_links(path)
    if Path.cwd().is_relative_to(target.resolve()):
        raise InputError(
            f"expected a folder that can be replaced as a whole, got {path}, which you are in; "
            "name another one, or go to the folder above it."
        )
    return target


@contextmanager
def replace_folder(path: str | Path) -> Iterator[Path]:
    """A fresh folder to fill, which takes the place of `path` when the block ends well.

    After an exception nothing has changed at `path`. Of a link, what it leads to is replaced.

    Raises
    ------
    InputError
        For a `path` that `folder_behind` refuses.
    """
    target = folder_behind(path)
    target.parent.mkdir(parents=True, exist_ok=True)
    fresh = Path(tempfile.mkdtemp(dir=target.parent, prefix=f".{target.name}."))
    try:
        yield fresh
        fresh.chmod(0o755)
        _swap(fresh, target)
    except BaseException:
        shutil.rmtree(fresh, ignore_errors=True)
        raise


def _swap(fresh: Path, target: Path) -> None:
    """Put `fresh` at `target`; what was there is deleted only once that has worked.

    What cannot be deleted then is no reason to fail: the new folder is in its place.
    """
    if not target.exists():
        fresh.rename(target)
        return
    old = fresh.with_name(fresh.name + ".old")
    target.rename(old)
    try:
        fresh.rename(target)
    except BaseException:
        old.rename(target)
        raise
    shutil.rmtree(old, ignore_errors=True)
    if old.exists():
        warnings.warn(
            f"expected to delete what was at {target} before, got a refusal; the new folder is "
            f"there, remove {old} yourself.",
            stacklevel=4,
        )


def check_replaceable(
    target: Path, *, index_name: str, what: str, beside: Collection[str] = ()
) -> None:
    """Refuse to replace anything but an empty folder or a set with nothing beside its own files.

    Its own are the index, the files that the index lists, `provenance.json` and the names `beside`.

    Raises
    ------
    InputError
        If `target` is a file, a folder with other contents, or one that cannot be replaced
        (`folder_behind`).
    """
    folder_behind(target)
    if target.is_file():
        raise InputError(f"expected a folder, got the file {target}; choose another name.")
    if not target.exists():
        return
    own = {index_name, "provenance.json", *beside}
    if (target / index_name).is_file():
        own |= {row["file"] for row in read_table(target / index_name, ("file",))}
    foreign = sorted({path.name for path in target.iterdir()} - own)
    if foreign:
        raise InputError(
            f"expected a new folder or {what}, got {target} with other files in it "
            f"({foreign[0]}); choose another folder."
        )


def write_table(path: str | Path, columns: Sequence[str], rows: Iterable[Sequence[object]]) -> None:
    """Write a TSV with a header line; cells must not hold tabs or line ends."""
    lines = ["\t".join(columns)]
    for row in rows:
        cells = [str(cell) for cell in row]
        if any(c in cell for cell in cells for c in "\t\r\n"):
            raise InputError(f"expected cells without tabs and line ends, got {cells}; rename.")
        lines.append("\t".join(cells))
    write_text(path, "\n".join(lines) + "\n")


def read_table(path: str | Path, required: Sequence[str]) -> list[dict[str, str]]:
    """Rows of a TSV as dictionaries by column name; lines that begin with # are comments.

    Raises
    ------
    InputError
        If the file is not there, is empty, lacks a required column, or a row has another number
        of cells than the header.
    """
    source = Path(path)
    if not source.is_file():
        raise InputError(f"expected a table at {source}, got no file there; give its path.")
    try:
        text = source.read_text(encoding="utf-8-sig")
    except UnicodeDecodeError:
        raise InputError(
            f"expected a text table, got other bytes in {source}; save it as UTF-8."
        ) from None
    # Not splitlines(): that would also break cells at characters that `write_table` allows.
    lines = [line for line in text.split("\n") if line.strip() and not line.startswith("#")]
    header = lines[0].split("\t") if lines else []
    missing = [name for name in required if name not in header]
    if missing:
        raise InputError(
            f"expected the columns {', '.join(required)} in {source}, got "
            f"{', '.join(header) or 'an empty file'}; add {', '.join(missing)} (tab-separated)."
        )
    rows = []
    for line in lines[1:]:
        cells = line.split("\t")
        if len(cells) != len(header):
            raise InputError(
                f"expected {len(header)} cells in each row of {source}, got {len(cells)} in "
                f"{line!r}; the table is damaged or not tab-separated."
            )
        rows.append(dict(zip(header, cells, strict=True)))
    return rows


def is_number(text: str) -> bool:
    """Whether a text reads as a number."""
    try:
        float(text)
    except ValueError:
        return False
    return True


def number(text: str, name: str) -> float:
    """A number from a table's cell.

    Raises
    ------
    InputError
        Naming `name`, where the cell is empty or no number.
    """
    if not is_number(text):
        got = repr(text) if text.strip() else "nothing"
        raise InputError(f"expected a number for {name}, got {got}; fill it in.")
    return float(text)


def whole_number(text: str, name: str) -> int:
    """A whole number of at least 1 from a table's cell; InputError naming `name` otherwise."""
    value = number(text, name)
    if not (value.is_integer() and value >= 1):
        raise InputError(f"expected a whole number for {name}, at least 1, got {text}; correct it.")
    return int(value)
