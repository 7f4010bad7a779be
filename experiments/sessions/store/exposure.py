"""How much vibration a participant's hand has had in a day, over all sessions of a data set."""

from __future__ import annotations

from collections.abc import Mapping
from contextlib import suppress
from datetime import date, datetime
from pathlib import Path
from typing import Any

from tactileq.experiments.sessions.kept.files import sessions_in
from tactileq.experiments.sessions.kept.log import read_log
from tactileq.modeling import InputError
from tactileq.modeling.vibrators.exposure import daily_exposure_m_s2

EXPOSURE = "exposure"


def exposed_g2_s(data_folder: str | Path, subject: int, *, on: date) -> float:
    """Weighted square of the acceleration over time (g²·s) that a participant had on a day.

    A log that cannot be read is left out: whoever goes on with its session is told so.
    """
    total = 0.0
    for files in sessions_in(data_folder):
        if files.subject == subject and files.log.is_file():
            with suppress(InputError):
                total += sum(_exposed(event, on) for event in read_log(files.log).events)
    return total


def _exposed(event: Mapping[str, Any], on: date) -> float:
    value = event.get("weighted_g2_s")
    if event["event"] != EXPOSURE or not isinstance(value, int | float):
        return 0.0
    moment = datetime.fromisoformat(event["utc"]).astimezone()  # here, where the day is counted
    return float(value) if moment.date() == on else 0.0


class Exposure:
    """The exposure of a participant's day, as a session adds to it.

    Parameters
    ----------
    before_g2_s : float
        Of that day, before this session.
    highest_m_s2 : float
        Daily exposure A(8) after which the session ends.
    """

    def __init__(self, before_g2_s: float, highest_m_s2: float) -> None:
        self._total_g2_s = before_g2_s
        self.highest_m_s2 = highest_m_s2

    def add(self, weighted_g2_s: float) -> None:
        """What was felt."""
        self._total_g2_s += weighted_g2_s

    @property
    def a8_m_s2(self) -> float:
        """Of the day so far."""
        return daily_exposure_m_s2(self._total_g2_s)

    @property
    def excess(self) -> str:
        """Why nothing more may be felt today, in one sentence; empty where it may."""
        if self.a8_m_s2 < self.highest_m_s2:
            return ""
        return (
            f"expected a daily exposure A(8) below {self.highest_m_s2:g} m/s², got "
            f"{self.a8_m_s2:.2f} m/s²; continue on another day."
        )
