"""The simulated experimenter, who is quick and careful."""

from __future__ import annotations

from tactileq.experiments.sessions.loop.people import ProgressReport


class SimulatedExperimenter:
    """Mounts every sample and repairs every rig at once.

    Attributes
    ----------
    asked : list of str
        The trays that were asked for, in order.
    calls : list of str
        What was reported to have failed.
    """

    def __init__(self) -> None:
        self.asked: list[str] = []
        self.calls: list[str] = []

    def ask_mount(self, tray: str) -> None:
        """The sample is mounted at once."""
        self.asked.append(tray)

    def call(self, sentence: str) -> None:
        """What failed is repaired at once."""
        self.calls.append(sentence)

    def go_on(self) -> None:
        """Never wants to stop."""

    def ready(self) -> bool:
        """Always."""
        return True

    def report(self, progress: ProgressReport) -> None:
        """Needs no information."""

    def page(self, name: str) -> None:
        """Nor this."""

    def answered(self) -> None:
        """Nor this."""
