"""What takes the events and answers of a session: the interface, and one that only remembers."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from types import TracebackType
from typing import Protocol, Self

from tactileq.rig.shared.interface import Acceleration, Fault, HandRows, PresentationRecord


class Store(Protocol):
    """Takes what happens in a session."""

    def log(self, event: str, **fields: object) -> None:
        """Take an event; returns at once.

        Raises
        ------
        StoreError
            If an earlier one could not be written.
        """

    def answer(self, trial: int, row: Mapping[str, object]) -> None:
        """Take an answer; it counts once this has returned.

        Raises
        ------
        StoreError
            If it, or an earlier event, could not be written.
        """

    def trace(
        self,
        trial: int,
        rows: HandRows,
        *,
        presentations: Sequence[PresentationRecord],
        faults: Sequence[Fault],
    ) -> None:
        """Take what the hand did in a trial, and what was presented to it.

        Raises
        ------
        StoreError
            If the disk does not take it.
        """

    def acceleration(self, trial: int, pieces: Sequence[Acceleration]) -> None:
        """Take what was measured at the pen in a trial.

        Raises
        ------
        StoreError
            If the disk does not take it.
        """

    def finish(self, status: str, reason: str = "", *, by: str = "") -> None:
        """Take how this run of the session ended: "complete", "aborted" or "crashed".

        Parameters
        ----------
        status : {"complete", "aborted", "crashed"}
        by : str
            Who or what ended it, such as "participant", "experimenter" or "signal".

        Raises
        ------
        StoreError
            If it, or an earlier event, could not be written.
        """

    def close(self) -> None:
        """Take nothing more; harmless when closed already.

        Raises
        ------
        StoreError
            If something could not be written.
        """

    def __enter__(self) -> Self:
        """Closed when the block ends."""

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        """Close; an error of the block is never hidden by one of the disk."""


class MemoryStore:
    """Keeps answers in memory, for studies that are only planned; nothing is written.

    Attributes
    ----------
    events : list of dict
        What was logged, each with its name under "event".
    rows : list of mapping
        The answers.
    status : str
        How it ended; empty before.
    """

    def __init__(self) -> None:
        self.events: list[dict[str, object]] = []
        self.rows: list[Mapping[str, object]] = []
        self.status = ""

    def log(self, event: str, **fields: object) -> None:
        """Keep an event."""
        self.events.append({"event": event, **fields})

    def answer(self, trial: int, row: Mapping[str, object]) -> None:
        """Keep an answer."""
        self.rows.append(row)

    def trace(
        self,
        trial: int,
        rows: HandRows,
        *,
        presentations: Sequence[PresentationRecord],
        faults: Sequence[Fault],
    ) -> None:
        """Keep nothing."""

    def acceleration(self, trial: int, pieces: Sequence[Acceleration]) -> None:
        """Keep nothing."""

    def finish(self, status: str, reason: str = "", *, by: str = "") -> None:
        """Keep how it ended."""
        self.status = status
        self.log("ended", status=status, reason=reason, by=by)

    def close(self) -> None:
        """Do nothing."""

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        self.close()
