"""Data sets as BIDS shows them: made from what sessions wrote, and compared with it.

All of it can be made again at any time, with the same bytes (docs/method/protocols.md#bids).
"""

from __future__ import annotations

from collections.abc import Collection, Iterable, Iterator, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path

from tactileq.experiments.sessions.bids.earlier import is_earlier
from tactileq.experiments.sessions.bids.people import people_files, people_there, readme
from tactileq.experiments.sessions.bids.session import Made, session_files
from tactileq.experiments.sessions.bids.tables import json_bytes
from tactileq.experiments.sessions.kept.data_set import DESCRIPTION_NAME, describe_data_set
from tactileq.experiments.sessions.kept.files import SessionFiles, sessions_in
from tactileq.experiments.sessions.kept.roster import Roster
from tactileq.experiments.sessions.kept.stored_sessions import (
    Damaged,
    StoredSession,
    held_of,
    held_session,
    held_sessions,
    participants_of,
)
from tactileq.modeling import InputError
from tactileq.modeling.errors import counted, shortened
from tactileq.modeling.files.documents import read_json_object
from tactileq.modeling.files.reading import LONGEST_PATH
from tactileq.modeling.files.writing import write_files


@dataclass(frozen=True, kw_only=True)
class Exported:
    """What was made from sessions.

    Parameters
    ----------
    new, changed : tuple of Path
        Files that were not there, and files that held something else.
    damaged : tuple of str
        What is damaged: sessions that cannot be read, of which nothing was touched, and rows of
        traces, which are not in the tables.
    """

    new: tuple[Path, ...] = ()
    changed: tuple[Path, ...] = ()
    damaged: tuple[str, ...] = ()


def export_session(data_folder: str | Path, manifest_path: str | Path) -> None:
    """Write what BIDS shows of a session, and the tables about people again.

    Parameters
    ----------
    data_folder : path
        Root of the data set.
    manifest_path : path
        The manifest of the session, below sourcedata.

    Raises
    ------
    InputError
        If it is no manifest of a session there, or its manifest or log cannot be read.
    OSError
        If the disk does not take the files; then all are as they were.
    """
    files = SessionFiles.of_manifest(Path(manifest_path))
    if files is None:
        raise InputError(
            f"expected the manifest of a session below {Path(data_folder) / 'sourcedata'}, got "
            f"{shortened(str(manifest_path), longest=LONGEST_PATH)}; give its path."
        )
    own = held_session(files)
    if own.state.events:  # killed before its first event, it has nothing to show
        _write(session_files(own)[0])
    root = Path(data_folder)
    _write(_people_after(root, own))
    with suppress(InputError):  # the next session is refused for it
        _write(_readme(root))


def export_all(data_folder: str | Path) -> Exported:
    """Write the BIDS tables of every session that is not running, where they differ.

    Returns
    -------
    Exported
        What is damaged costs what follows from it and nothing else.

    Raises
    ------
    OSError
        If the disk does not take the files of a session; then those are as they were.
    """
    root = Path(data_folder)
    held, damaged = held_sessions(root)
    new: list[Path] = []
    changed: list[Path] = []
    sentences = [one.sentence for one in damaged]
    for one in filter(_to_be_shown, held):
        made, rows = session_files(one)
        sentences += [f"{one.files.stem}: {row}" for row in rows]
        _write(made, new=new, changed=changed)
    _write(_people(root, held, damaged=damaged), new=new, changed=changed)
    try:
        _write(_readme(root), new=new, changed=changed)
    except InputError as error:
        sentences.append(str(error))
    return Exported(new=tuple(new), changed=tuple(changed), damaged=tuple(sentences))


def require_tables(
    data_folder: str | Path,
    *,
    task: str | None = None,
    subject: int | None = None,
    otherwise: str,
) -> None:
    """Refuse tables of sessions that are not what these wrote; nothing is written.

    A session that somebody runs now has none yet that could be compared, and of a data set without
    source data nothing is.

    Parameters
    ----------
    task, subject : str, int, optional
        Which sessions are to be read; all without them.
    otherwise : str
        What to do where a session is damaged, beside restoring it; {who} stands for its
        participant.

    Raises
    ------
    InputError
        For the first session that is damaged, or the first table that is another one, or is not
        there.
    """
    root = Path(data_folder)
    held, damaged = held_sessions(root)

    def read(files: SessionFiles) -> bool:
        return task in (None, files.task) and subject in (None, files.subject)

    for one in damaged:
        if read(one.files):
            advice = otherwise.format(who=one.files.participant)
            raise InputError(f"{one.sentence.removesuffix('.')}, or {advice}.")
    ended = (one for one in held if _to_be_shown(one) and read(one.files))
    wrong = [path for one in ended for path in _sorted_out(session_files(one)[0])[0]]
    if wrong:
        others = len(wrong) - 1
        more = f" (and {counted(others, 'more file')})" if others else ""
        got = "differs" if wrong[0].exists() else "is missing"
        raise InputError(
            f"expected tables that agree with the logs of their sessions, got {wrong[0]}, which "
            f"{got}{more}; make them again with tactileq study status --data {root}, which says "
            "what it changes."
        )


def differing_tables(
    root: Path, held: Sequence[StoredSession], damaged: Sequence[Damaged]
) -> tuple[list[Path], list[Path]]:
    """Every file that is not what all sessions that have ended give, made anew.

    Returns
    -------
    list of Path
        Those that are not there or hold something else.
    list of Path
        Those that an earlier version made of the same sessions.
    """
    found = [_sorted_out(session_files(one, anew=True)[0]) for one in held if _to_be_shown(one)]
    if any(one.files.answers.is_file() for one in held):
        # Of who has a session running they are those of before.
        kept = participants_of(one for one in held if one.running)
        found.append(_sorted_out(_people(root, list(held), damaged=list(damaged), kept=kept)))
        with suppress(InputError):  # a description that cannot be read differs itself
            found.append(_sorted_out(_readme(root)))
    return [p for wrong, _ in found for p in wrong], [p for _, earlier in found for p in earlier]


def _to_be_shown(held: StoredSession) -> bool:
    """Whether a session has ended, and had begun."""
    return bool(held.state.events) and not held.running


def _people(
    root: Path,
    held: list[StoredSession],
    *,
    damaged: list[Damaged],
    kept: Collection[str] = (),
    others: Collection[str] = (),
) -> Made:
    """The tables about people of all sessions that are shown; `kept` are people left alone, and
    `others` people whose sessions are not among these.

    Nothing of a data set that also holds people without source data, as one that was published.
    """
    visible = [one for one in held if one.files.answers.is_file()]
    if (damaged and not visible) or not (held or (root / "participants.tsv").exists()):
        return {}
    # What is shown of a session whose log or manifest cannot be read stays as it is.
    lost = participants_of(damaged)
    known = participants_of(visible) | lost
    there = {path.parts[-4] for path in _answer_tables(root)}
    if not there <= known.union(others):
        return {}
    roster = Roster(root).listed()
    kept = {*lost, *_without_source(root, [*held, *damaged]), *kept}
    rows_kept = {*(there if roster.damaged else kept), *others}
    made = people_files(root, visible, roster.entries, rows_kept=rows_kept, kept=kept)
    description = root / DESCRIPTION_NAME
    if visible and not description.is_file():
        first = min(visible, key=lambda one: one.state.begun_utc)
        made[description] = json_bytes(describe_data_set(first.manifest))
    return made


def _people_after(root: Path, own: StoredSession) -> Made:
    """The tables about people after a session, of which only those of its participant change.

    The others' rows stay as they are, so that this takes no longer the more sessions there are;
    all are made where somebody has none yet, columns change, or their description does not follow
    from these sessions alone: somebody else left a question unanswered.
    """
    table, name = root / "participants.tsv", own.files.participant
    described = table.with_suffix(".json")
    everybody = sessions_in(root)
    shown = {files.participant for files in everybody if files.answers.is_file()}
    others = shown - {name}
    if others and (root / DESCRIPTION_NAME).is_file() and others <= people_there(table):
        held, damaged = held_of(files for files in everybody if files.participant == name)
        made = _people(root, held, damaged=damaged, others=others)
        if table in made and not _differing({described: made[described]}):
            return made
    held, damaged = held_sessions(root)
    return _people(root, held, damaged=damaged)


def _without_source(root: Path, sessions: Iterable[StoredSession | Damaged]) -> set[str]:
    """People with a table of answers from which nothing is there that it was made from."""
    read = {one.files.answers for one in sessions}
    return {path.parts[-4] for path in _answer_tables(root) if path not in read}


def _answer_tables(root: Path) -> Iterator[Path]:
    """All tables of answers under the name of their participant; other folders are somebody's."""
    for path in root.glob("sub-*/ses-*/beh/*_beh.tsv"):
        if path.name.startswith(f"{path.parts[-4]}_"):
            yield path


def _readme(root: Path) -> Made:
    description = root / DESCRIPTION_NAME
    if not description.is_file():
        return {}
    return {root / "README": readme(read_json_object(description, advice="restore the file"))}


def _differing(made: Mapping[Path, bytes]) -> list[Path]:
    """The files that are not there, or hold something else."""
    changed = []
    for path, data in made.items():
        with suppress(OSError):
            if path.read_bytes() == data:
                continue
        changed.append(path)
    return changed


def _sorted_out(made: Mapping[Path, bytes]) -> tuple[list[Path], list[Path]]:
    """Of the files that differ those that nobody made so, and those that an earlier version did."""
    differing: list[Path] = []
    earlier: list[Path] = []
    for path in _differing(made):
        (earlier if is_earlier(path, made[path]) else differing).append(path)
    return differing, earlier


def _write(
    made: Mapping[Path, bytes],
    *,
    new: list[Path] | None = None,
    changed: list[Path] | None = None,
) -> None:
    """Write the files that hold something else, all or none, and note which."""
    paths = _differing(made)
    there = [path for path in paths if path.exists()]
    for folder in {path.parent for path in paths}:
        folder.mkdir(parents=True, exist_ok=True)
    write_files({path: made[path] for path in paths})
    if new is not None and changed is not None:
        changed += there
        new += [path for path in paths if path not in there]
