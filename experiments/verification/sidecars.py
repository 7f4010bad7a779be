"""Data that were published without what sessions wrote: the hashes in their sidecars.

docs/method/verification.md#published
"""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

from tactileq.experiments.verification.difference import Difference
from tactileq.modeling import InputError
from tactileq.modeling.files.documents import read_json_object
from tactileq.modeling.files.hashes import sha256_of_file


def check_sidecars(root: Path) -> tuple[tuple[Difference, ...], tuple[str, ...]]:
    """Every file that the sidecar of a session's answers lists, by its SHA-256.

    Returns
    -------
    tuple of Difference
    tuple of str
        The sessions, as sub-01_ses-01_task-absolute.
    """
    found: list[Difference] = []
    sessions = []
    for table in sorted(root.glob("sub-*/ses-*/beh/sub-*_beh.tsv")):
        sessions.append(table.name.removesuffix("_beh.tsv"))
        found += _of_session(root, table)
    return tuple(found), tuple(sessions)


def _of_session(root: Path, table: Path) -> list[Difference]:
    sidecar, who = table.with_suffix(".json"), table.parts[-4]

    def differs(path: Path, sentence: str) -> Difference:
        place = path.relative_to(root).as_posix()
        return Difference(place=place, sentence=sentence, participant=who)

    try:
        stated = read_json_object(sidecar, advice="restore the file").get("Files")
    except InputError as error:
        return [differs(sidecar, f"expected the sidecar of the answers, got {error}")]
    if not isinstance(stated, Mapping):
        return [differs(sidecar, "expected the SHA-256 of the session's files, got none")]
    found = []
    stem = table.name.removesuffix("beh.tsv")
    for path in sorted(table.parent.glob(f"{stem}*")):
        if path != sidecar and path.name not in stated:
            found.append(differs(path, "expected a file that its sidecar lists, got another"))
    for name, sha256 in stated.items():
        path = table.parent / Path(str(name)).name
        if not path.is_file():
            found.append(differs(path, "expected the file that its sidecar lists, got none"))
        elif sha256_of_file(path) != sha256:
            found.append(differs(path, "expected the SHA-256 in its sidecar, got another"))
    return found
