"""Replacing whole folders, so that nothing half-written remains."""

from __future__ import annotations

import os
import shutil
import warnings
from collections.abc import Collection, Iterator
from contextlib import contextmanager
from pathlib import Path

from modeling.errors import InputError, shown
from modeling.files.places import (
    behind_links,
    clear_unfinished,
    locked,
    unfinished_folder,
)
from modeling.files.reading import check_file
from modeling.files.tables import read_table


def folder_behind(path: str | Path) -> Path:
    """The folder that `replace_folder` would replace, behind links.

    What killed processes left beside it and in it is cleared up first.

    Raises
    ------
    InputError
        For a link that leads nowhere, and for a folder that this process is in: a program that
        stands in a folder is left in the old one when that is replaced.
    """
    target = behind_links(path)
    # Not resolve(), which raises for links in a circle.
    if Path.cwd().is_relative_to(os.path.realpath(target)):
        raise InputError(
            f"expected a folder that can be replaced as a whole, got {path}, which you are in; "
            "name another one, or go to the folder above it."
        )
    clear_unfinished(target.parent)
    clear_unfinished(target)
    return target


@contextmanager
def replace_folder(path: str | Path) -> Iterator[Path]:
    """A fresh folder to fill, which takes the place of `path` when the block ends well.

    After an exception nothing has changed at `path`. Of a link, what it leads to is replaced.
    Of two processes that do so at once, what the one that ends last made stays.

    Raises
    ------
    InputError
        For a `path` that `folder_behind` refuses.
    OSError
        With the name that a file would have had at `path`, not with its hidden one.
    """
    target = folder_behind(path)
    with unfinished_folder(target) as hidden:
        fresh = hidden / target.name
        with _named(target, fresh):
            fresh.mkdir()
            yield fresh
            fresh.chmod(0o755)
            with locked(target):
                _swap(fresh, target)


@contextmanager
def _named(target: Path, fresh: Path) -> Iterator[None]:
    """The system's errors name places in `target`, or `target` where they named none."""
    try:
        yield
    except OSError as error:
        named = fresh if error.filename is None else error.filename
        if error.errno is not None and isinstance(named, str | Path):
            inside = Path(named).is_relative_to(fresh)
            place = target / Path(named).relative_to(fresh) if inside else named
            error.filename, error.filename2 = str(place), None
        raise


def _swap(fresh: Path, target: Path) -> None:
    """Put `fresh` at `target`; what was there is deleted only once that has worked.

    What cannot be deleted then is no reason to fail: the new folder is in its place. A process that
    is killed between the two steps leaves the old folder to `clear_unfinished`.
    """
    if not target.exists():
        fresh.rename(target)
        return
    old = fresh.with_name(fresh.name + ".old")
    try:
        target.rename(old)
        fresh.rename(target)
    except BaseException:
        if old.exists() and not target.exists():
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
        listed = {row["file"] for row in read_table(target / index_name, ("file",))}
        # A folder of that name is none of the set's files, and may hold anything.
        own |= {name for name in listed if not (target / name).is_dir()}
    foreign = sorted({path.name for path in target.iterdir()} - own)
    if foreign:
        raise InputError(
            f"expected a new folder or {what}, got {target} with other files in it "
            f"({foreign[0]}); choose another folder."
        )


def listed_file(folder: Path, name: str, *, index_name: str) -> Path:
    """The file that the index of a folder names, which must lie in that folder.

    A link in the folder may lead to a file elsewhere, as where data are kept by git-annex.

    Raises
    ------
    InputError
        For a name that leads out of the folder, and where no file is.
    """
    if Path(name).is_absolute() or ".." in Path(os.path.normpath(name)).parts:
        raise InputError(
            f"expected only files within {folder} in its {index_name}, got {shown(name)}, which "
            "lies outside; copy the file into the folder."
        )
    path = folder / name
    check_file(path, "the file", advice=f"restore it, or take it out of {index_name}")
    return path
