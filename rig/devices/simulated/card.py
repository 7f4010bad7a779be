"""Starts the simulated vibrator as a separate process, and ends it."""

from __future__ import annotations

from tactileq.modeling.errors import InputError
from tactileq.rig.devices.simulated.process import Card
from tactileq.rig.devices.simulated.vibrator import SimulatedTransducers
from tactileq.rig.shared.live.child import Child, ChildLost
from tactileq.rig.shared.live.messages import Done

DEVICE = "simulated-vibrator"


class SimulatedCard:
    """A sound card in silico on which a simulated vibrator hangs; use it in a `with` block.

    It needs a running JACK server. Play on the device called `name`, and record from it: its first
    input is the accelerometer.

    Parameters
    ----------
    name : str
        By which PortAudio lists it.
    """

    def __init__(self, vibrator: SimulatedTransducers | None = None, *, name: str = DEVICE) -> None:
        self.vibrator = vibrator or SimulatedTransducers()
        self.name = name
        self._child: Child | None = None

    def open(self) -> None:
        """Start it, and wait until it runs.

        Raises
        ------
        InputError
            Without a JACK server.
        """
        self._child = Child(
            "tactileq.rig.devices.simulated.process", Card(self.vibrator, self.name)
        )
        try:
            self._child.ready(Done)
        except ChildLost as lost:
            raise InputError(
                f"expected the simulated vibrator to start, got: {lost}; check that a "
                "JACK server is running."
            ) from None

    def close(self) -> None:
        """End it; closing twice does nothing."""
        if self._child is not None:
            self._child.close()
            self._child = None

    @property
    def runs(self) -> bool:
        """Whether it was started and has not ended."""
        return self._child is not None and self._child.runs

    def __enter__(self) -> SimulatedCard:
        self.open()
        return self

    def __exit__(self, *_: object) -> None:
        self.close()
