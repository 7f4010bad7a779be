"""Whether a session may begin: not twice, not before its day, not in others' data.

docs/method/protocols.md#admission
"""

from __future__ import annotations

from dataclasses import replace
from datetime import date, datetime

from tactileq.experiments.sessions.kept.data_set import claim_data_set, require_same_data_set
from tactileq.experiments.sessions.kept.files import SessionFiles
from tactileq.experiments.sessions.kept.log import now_utc
from tactileq.experiments.sessions.kept.manifest import SessionManifest
from tactileq.experiments.sessions.kept.overrides import Overrides
from tactileq.experiments.sessions.kept.state import session_state
from tactileq.modeling import InputError

_AGAIN = {
    "running": "another console runs it now; wait for its end",
    "complete": "it is complete; choose another subject or session",
    "aborted": "it was aborted; continue with --resume",
    "crashed": "it was interrupted; continue with --resume",
}


def admit(files: SessionFiles, manifest: SessionManifest, *, overrides: Overrides) -> None:
    """Refuse a session that has begun, comes too early, or does not belong into its data folder.

    Parameters
    ----------
    overrides : Overrides
        Takes what goes on against a rule.

    Raises
    ------
    InputError
    OSError
        If the disk does not take the description of the data set.
    """
    require_admissible(files, manifest, overrides=overrides)
    claim_data_set(files.root, manifest, overrides=overrides)


def require_admissible(
    files: SessionFiles, manifest: SessionManifest, *, overrides: Overrides
) -> None:
    """Refuse as `admit` does; nothing is written."""
    refuse_begun(files)
    if manifest.session > 1:
        _require_day_before(files, manifest, overrides=overrides)
    require_same_data_set(files.root, manifest, overrides=overrides)


def refuse_begun(files: SessionFiles) -> None:
    """InputError where a session has any file."""
    there = files.there()
    if files.manifest in there:
        raise InputError(
            f"expected a session that has not been run, got {files.stem}, and "
            f"{_AGAIN[session_state(files.log).status]}."
        )
    if there:
        raise InputError(
            f"expected a session that has not been run, got {files.stem}, which has the file "
            f"{there[0]} but no manifest; move that file away."
        )


def _require_day_before(
    files: SessionFiles, manifest: SessionManifest, *, overrides: Overrides
) -> None:
    """The session before must be complete and, of a person, have ended on an earlier date."""
    before = replace(files, session=manifest.session - 1)
    try:
        state = session_state(before.log)
    except InputError as error:
        overrides.allow("unreadable log", str(error).removesuffix("."))
        return
    if state.status != "complete":
        got = state.status if before.manifest.exists() else "no such session"
        overrides.allow(
            "day before",
            f"expected {before.stem} complete before session {manifest.session}, got {got}; "
            "complete that one first",
        )
    if not state.last_utc or manifest.simulated_participant:
        return
    ended, today = _local_date(datetime.fromisoformat(state.last_utc)), _local_date(now_utc())
    if ended >= today:
        overrides.allow(
            "same date",
            f"expected session {manifest.session} on a later date than {before.stem}, which ended "
            f"on {ended}, got {today}; let the participant come back on another day",
        )


def _local_date(moment: datetime) -> date:
    return moment.astimezone().date()
