"""One thing that is not as it was stored."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True, kw_only=True)
class Difference:
    """A difference between what is there and what must have been stored.

    Parameters
    ----------
    place : str
        The file, by its path in the data set.
    trial : int, optional
        Its number, where the difference is in one.
    sentence : str
        Expected and got.
    participant : str
        Whose, as sub-01; empty where it is about no one or several.
    """

    place: str
    sentence: str
    trial: int | None = None
    participant: str = ""

    def __str__(self) -> str:
        where = self.place if self.trial is None else f"{self.place}, trial {self.trial}"
        return f"{where}: {self.sentence}"
