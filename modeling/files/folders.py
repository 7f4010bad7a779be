"""Replacing whole folders, so that nothing half-written remains."""

from __future__ import annotations

import itertools
import os
import shutil
import warnings
from collections.abc import Collection, Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path

from tactileq.modeling.errors import InputError, shown
from tactileq.modeling.files.columns import Column
from tactileq.modeling.files.places import (
    behind_links,
    clear_unfinished,
    is_hidden,
    locked,
    unfinished_folder,
)
from tactileq.modeling.files.reading import check_file
from tactileq.modeling.files.syncing import sync_folder, sync_tree
from tactileq.modeling.files.tables import read_cells

Contents = Mapping[str, tuple[int, ...]]


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


def contents_of(folder: Path) -> Contents:
    """What is at a place, nothing where it is empty, to see later whether it is still that.

    Returns
    -------
    dict
        Path below the folder → size and time of change of a file; of a folder nothing.
    """
    if folder.is_file():
        return {".": _stamp(folder)}
    found: dict[str, tuple[int, ...]] = {}
    for here, folders, files in os.walk(folder):
        folders[:] = [name for name in folders if not is_hidden(name)]
        for name in [*folders, *files]:
            path = Path(here, name)
            if not is_hidden(name):
                place = path.relative_to(folder).as_posix()
                found[place] = () if name in folders else _stamp(path)
    return found


def _stamp(path: Path) -> tuple[int, ...]:
    status = path.lstat()
    return status.st_size, status.st_mtime_ns


@contextmanager
def replace_folder(path: str | Path, seen: Contents | None = None) -> Iterator[Path]:
    """A fresh folder to fill, which takes the place of `path` when the block ends well.

    After an exception nothing has changed at `path`. Of a link, what it leads to is replaced. What
    is not at `path` as it was `seen`, because others changed it or put it there, stays; the fresh
    folder is then kept beside it.

    Parameters
    ----------
    seen : dict, optional
        `contents_of` the folder when it was found to be one that may be replaced; without it, that
        is now.

    Yields
    ------
    Path
        The fresh folder, absolute: other processes and a change of folder mean the same place.

    Raises
    ------
    InputError
        For a `path` that `folder_behind` refuses, one that was changed meanwhile, and one that
        another process keeps locked; the last two name where the fresh folder is.
    OSError
        With the name that a file would have had at `path`, not with its hidden one.
    """
    given = folder_behind(path)
    target = given.absolute()
    before = contents_of(target) if seen is None else seen
    with _as_given(given, target), unfinished_folder(target) as hidden:
        fresh = hidden / target.name
        with _named(target, fresh):
            fresh.mkdir()
            yield fresh
            sync_tree(fresh)
            try:
                with locked(target):
                    _swap(fresh, target, before)
            except InputError as error:
                raise InputError(f"{error} What was made is in {_kept(fresh, target)}.") from None
        _delete(_old(fresh), target)


@contextmanager
def _as_given(given: Path, target: Path) -> Iterator[None]:
    """The system's errors name places in `target`, and above it, from where `given` begins."""
    base = target.parents[len(given.parts) - 1] if not given.is_absolute() else None
    try:
        yield
    except OSError as error:
        if base is not None and isinstance(error.filename, str | Path):
            place = Path(error.filename)
            if place.is_relative_to(base) and place != base:
                error.filename = str(place.relative_to(base))
        raise


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


def _old(fresh: Path) -> Path:
    """Where what `fresh` takes the place of is, until it is deleted."""
    return fresh.with_name(fresh.name + ".old")


def _swap(fresh: Path, target: Path, before: Contents) -> None:
    """Put `fresh` at `target`, and what was there beside it.

    A process that is killed between the two steps leaves the old folder to `clear_unfinished`.
    """
    old = _old(fresh)
    try:
        if target.exists():
            clear_unfinished(target)  # who writes into it now ends first, and is seen
            target.rename(old)
            # Only now, when nobody finds it any more, can nothing be added to it.
            _check_same(contents_of(old), before, target)
        try:
            fresh.rename(target)
        except OSError:
            _check_same(contents_of(target), {}, target)
            raise
        sync_folder(target.parent)
    except BaseException:
        if old.exists():
            _put_back(old, target)
        raise


def _delete(old: Path, target: Path) -> None:
    """What cannot be deleted is no reason to fail: the new folder is in its place."""
    shutil.rmtree(old, ignore_errors=True)
    if old.exists():
        warnings.warn(
            f"expected to delete what was at {target} before, got a refusal; the new folder is "
            f"there, remove {old} yourself.",
            stacklevel=4,
        )


def _check_same(now: Contents, before: Contents, target: Path) -> None:
    """InputError where what is replaced is not what was found to be replaceable."""
    changed = sorted(name for name in now.keys() | before if now.get(name) != before.get(name))
    if changed:
        raise InputError(
            f"expected {target} as it was before the run, got {changed[0]}, which was added, "
            "changed or removed in the meantime, so all of it stays; move one of the "
            "two folders away."
        )


def _put_back(old: Path, target: Path) -> None:
    """Put a folder back; beside its place where somebody has made another one there meanwhile."""
    try:
        old.rename(target)
    except OSError:
        _kept(old, target)


def _kept(folder: Path, target: Path) -> Path:
    """Move a hidden folder to a visible place beside `target`; return that place."""
    names = (f"{target.name}-{number}" for number in itertools.count(2))
    place = next(p for name in names if not os.path.lexists(p := target.with_name(name)))
    folder.rename(place)
    sync_folder(place.parent)
    return place


def check_replaceable(
    target: Path, *, index_name: str, what: str, beside: Collection[str] = ()
) -> Contents:
    """Refuse to replace anything but an empty folder or a set with nothing beside its own files.

    Its own are the index, the files that the index lists, `provenance.json` and the names `beside`.

    Returns
    -------
    dict
        `contents_of` the folder, for `replace_folder`.

    Raises
    ------
    InputError
        If `target` is a file, a folder with other contents, or one that cannot be replaced
        (`folder_behind`).
    """
    folder_behind(target)
    if target.is_file():
        raise InputError(f"expected a folder, got the file {target}; choose another name.")
    seen = contents_of(target)
    if not target.exists():
        return seen
    own = {index_name, "provenance.json", *beside}
    if (target / index_name).is_file():
        listed = {row["file"] for _, row in read_cells(target / index_name, [Column("file")])}
        # A folder of that name is none of the set's files, and may hold anything.
        own |= {name for name in listed if not (target / name).is_dir()}
    foreign = sorted({name for name in seen if "/" not in name} - own)
    if foreign:
        raise InputError(
            f"expected a new folder or {what}, got {target} with other files in it "
            f"({foreign[0]}); choose another folder."
        )
    return seen


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
    check_file(path, "the file", advice=f"restore it, or remove it from {index_name}")
    return path
