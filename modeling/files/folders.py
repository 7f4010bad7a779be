"""Replacing whole folders, so that nothing half-written remains."""

from __future__ import annotations

import shutil
import tempfile
import warnings
from collections.abc import Collection, Iterator
from contextlib import contextmanager
from pathlib import Path

from modeling.errors import InputError
from modeling.files.tables import read_table
from modeling.files.writing import behind_links


def folder_behind(path: str | Path) -> Path:
    """The folder that `replace_folder` would replace, behind links.

    Raises
    ------
    InputError
        For a link that leads nowhere, and for a folder that this process is in: a program that
        stands in a folder is left in the old one when that is replaced.
    """
    target = behind_links(path)
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
