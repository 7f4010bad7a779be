"""Whether a session may begin: not twice, not before its day, not in others' data.

docs/method/protocols.md#admission
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from datetime import date, datetime, timedelta
from pathlib import Path

from tactileq.experiments.sessions.kept.data_set import claim_data_set, require_same_data_set
from tactileq.experiments.sessions.kept.files import SessionFiles
from tactileq.experiments.sessions.kept.log import YEARS, now_utc, utc_text
from tactileq.experiments.sessions.kept.manifest import SessionManifest
from tactileq.experiments.sessions.kept.overrides import Overrides
from tactileq.experiments.sessions.kept.roster import Roster
from tactileq.experiments.sessions.kept.state import session_state
from tactileq.modeling import InputError

_AGAIN = {
    "running": "another console runs it now; wait for its end",
    "complete": "it is complete; choose another subject or session",
    "aborted": "it was aborted; continue with --resume",
    "crashed": "it was interrupted; continue with --resume",
}


# Two computers that share a folder differ by less.
_CLOCKS_DIFFER = timedelta(minutes=1)


def check_clock(root: Path, *, tell: Callable[[str], None]) -> None:
    """Refuse a clock whose times cannot be read again, and tell of one that was set back.

    Parameters
    ----------
    root : Path
        Of the data set.
    tell : callable
        Called with one sentence where the clock stands before the last line of the roster.

    Raises
    ------
    InputError
    """
    now = now_utc()
    if now.year not in YEARS:
        raise InputError(
            f"expected a clock between the years {YEARS[0]} and {YEARS[-1]}, got {utc_text(now)}; "
            "set the date and time of this computer."
        )
    latest = Roster(root).listed().latest_utc
    if latest and now + _CLOCKS_DIFFER < datetime.fromisoformat(latest):
        tell(
            f"note: the clock of this computer says {utc_text(now)}, which is before {latest}, "
            "when something was stored here last; set it if it is wrong."
        )


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
