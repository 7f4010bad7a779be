"""What a run reads, hashed before it is read, and writes: whole, in the place of its own alone."""

from __future__ import annotations

import os
from collections.abc import Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from tactileq.modeling.files.folders import Contents


class CommandRun:
    """What the results of a command come from.

    Attributes
    ----------
    inputs : dict of str to str
        SHA-256 of each file and folder that is read, by its path.
    """

    def __init__(self, command: str) -> None:
        self.command = command
        self.inputs: dict[str, str] = {}

    def reads(self, *paths: Path | None) -> None:
        """Hash files and folders, before they are read; None is none, and what is known stays."""
        from tactileq.modeling.files.hashes import sha256_of_paths

        new = (path for path in paths if path is not None and str(path) not in self.inputs)
        self.inputs |= sha256_of_paths(new)

    def provenance(
        self, settings: Mapping[str, object], *, seed: int | None = None
    ) -> dict[str, Any]:
        """Versions, settings, seed and inputs, as they stand beside results."""
        from tactileq.modeling.files.provenance import provenance_of

        return provenance_of(self.command, settings, seed=seed, inputs=self.inputs)


class FolderResults(CommandRun):
    """Results that are a folder.

    Parameters
    ----------
    out : Path
        Refused unless it is new, or an earlier run of the same command made all of it.
    """

    def __init__(self, out: Path, command: str) -> None:
        super().__init__(command)
        self.out, self._seen = out, check_own_results(out, command)

    @contextmanager
    def folder(self, provenance: Mapping[str, Any]) -> Iterator[Path]:
        """A new folder to fill; sealed with the provenance, as it then is, it takes its place."""
        from tactileq.modeling.files.folders import replace_folder
        from tactileq.modeling.files.provenance import seal_folder

        with replace_folder(self.out, self._seen) as fresh:
            yield fresh
            seal_folder(fresh, provenance)


class FileResults:
    """Results that are files of one folder, with their provenance beside them.

    No run itself: what the files are called may depend on what was read.

    Parameters
    ----------
    files : sequence of Path
        All that may be written; refused as by `check_own_files`.
    note : Path, optional
        Their provenance; of a single file by default its name with _provenance.json.
    texture : str, optional
        What they are about.
    inputs : iterable of Path
        What may not be among the files.
    """

    def __init__(
        self,
        files: Sequence[Path],
        command: str,
        *,
        note: Path | None = None,
        texture: str | None = None,
        inputs: Iterable[Path] = (),
    ) -> None:
        self.note = Path(f"{files[0]}_provenance.json") if note is None else note
        self.texture = texture
        check_own_files(files, self.note, command=command, texture=texture, inputs=inputs)

    def write(self, contents: Mapping[Path, bytes], provenance: Mapping[str, Any]) -> None:
        """Write files with their provenance, all or none."""
        write_own_files(contents, self.note, provenance, texture=self.texture)


def check_own_results(out: Path, command: str) -> Contents:
    """Refuse to replace a folder unless an earlier run of the same command made all of it.

    Its provenance lists what that run wrote; any other file or folder below it is foreign. What is
    in the folder is returned, for `replace_folder`, which puts nothing in the place of anything
    else.
    """
    from tactileq.modeling.files.folders import contents_of, folder_behind
    from tactileq.modeling.files.provenance import PROVENANCE_NAME

    seen = contents_of(folder_behind(out))
    if not out.exists():
        return seen
    foreign = "a file"
    if out.is_dir():
        note = _object(out / PROVENANCE_NAME)
        own = {PROVENANCE_NAME, *_files(note)} if _is_of(note, command) else set()
        other = next(_beside(out, own), None)
        if other is None:
            return seen
        foreign = f"a folder with other files in it ({other})"
    raise ValueError(
        f"expected a new folder or earlier results of tactileq {command} at {out}, got {foreign}; "
        "choose another folder with --out."
    )


def check_own_files(
    files: Iterable[Path],
    note: Path,
    *,
    command: str,
    texture: str | None = None,
    inputs: Iterable[Path] = (),
) -> None:
    """Refuse to write files in the place of an input or of anything that is not the same run's.

    Parameters
    ----------
    files : iterable of Path
        All that may be written, in one folder.
    note : Path
        Their provenance beside them: an existing file may be replaced if this names the same
        command and texture and lists the file.
    texture : str, optional
        What the files are about.
    inputs : iterable of Path
        What the run reads.
    """
    from tactileq.modeling.files.places import clear_unfinished

    clear_unfinished(note.parent)
    given = [path for path in inputs if path.exists()]
    found = [path for path in (*files, note) if os.path.lexists(path)]
    for path in found:
        if path.exists() and any(path.samefile(one) for one in given):
            raise ValueError(
                f"expected a file other than the input, got {path}, which is the input itself; "
                "choose another name or folder with --out."
            )
    if not found:
        return
    made = _object(note)
    own = {note.name, *_files(made)} if _is_of(made, command) else set()
    foreign = [path for path in found if path.name not in own]
    if foreign:
        maker = made.get("command")
        other = f"one of {maker}" if maker and not _is_of(made, command) else "something else"
        raise ValueError(
            f"expected a new file or an earlier result of tactileq {command} at {foreign[0]}, got "
            f"{other}; choose another name or folder with --out."
        )
    if made.get("texture") != texture:
        raise ValueError(
            f"expected a new file or an earlier result for {texture!r} at {found[0]}, got one for "
            f"{made.get('texture')!r}, whose file has the same name; choose another name or folder "
            "with --out."
        )


def write_own_files(
    contents: Mapping[Path, bytes],
    note: Path,
    provenance: Mapping[str, Any],
    *,
    texture: str | None = None,
) -> None:
    """Write files with their provenance, all or none, once more refusing what is not our own.

    The provenance lists them, and what earlier runs wrote beside it for the same texture.
    """
    from tactileq.modeling.files.places import locked
    from tactileq.modeling.files.provenance import provenance_text
    from tactileq.modeling.files.writing import write_files

    command = str(provenance["command"]).removeprefix("tactileq ")
    with locked(note):
        check_own_files(contents, note, command=command, texture=texture)
        earlier = [name for name in _files(_object(note)) if (note.parent / name).exists()]
        names = sorted({path.name for path in contents} | set(earlier))
        text = provenance_text({**provenance, "texture": texture, "files": names})
        # Provenance first: a run that is killed here does not leave files that nobody owns.
        write_files({note: text.encode(), **contents})


def _is_of(note: Mapping[str, Any], command: str) -> bool:
    return bool(note.get("command") == f"tactileq {command}")


def _files(note: Mapping[str, Any]) -> list[str]:
    """The names that a provenance lists; none in one of an earlier version."""
    names = note.get("files")
    return [name for name in names if isinstance(name, str)] if isinstance(names, list) else []


def _beside(folder: Path, own: Iterable[str]) -> Iterator[str]:
    """Names of files and folders below a folder that are not its own, in order."""
    from tactileq.modeling.files.places import is_hidden

    own = set(own)
    parents = {parent.as_posix() for name in own for parent in Path(name).parents}
    for here, folders, files in os.walk(folder):
        place = Path(here).relative_to(folder)
        for name in sorted(files):
            if (place / name).as_posix() not in own and not is_hidden(name):
                yield (place / name).as_posix()
        for name in sorted(folders):
            path = place / name
            if path.as_posix() not in parents or (folder / path).is_symlink():
                yield f"{path.as_posix()}{os.sep}"
        folders.sort()


def _object(note: Path) -> dict[str, Any]:
    """What a provenance says; nothing where there is none."""
    from tactileq.modeling.files.documents import read_json_object

    return read_json_object(note, advice="remove the file") if note.is_file() else {}
