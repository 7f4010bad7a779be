"""The acceleration that is measured at the pen while something is presented."""

from __future__ import annotations

import numpy as np

from tactileq.modeling import InputError
from tactileq.rig.desk.messages import Begin, End, Listening, Take, Taken
from tactileq.rig.desk.parts import input_settings
from tactileq.rig.shared.interface import Acceleration
from tactileq.rig.shared.live.child import Child, ChildLost, Reply
from tactileq.rig.shared.live.messages import Done, Message
from tactileq.rig.shared.setup.sections import AccelerometerSection

TAKE_S = 30.0


class Pen:
    """An accelerometer, followed by a process of its own; used in a `with` block.

    Parameters
    ----------
    section : AccelerometerSection
        What the rig file says of it.
    """

    def __init__(self, section: AccelerometerSection) -> None:
        self._section = section
        self._child: Child | None = None
        self._rate_hz = 0.0
        self.lost = ""

    def __enter__(self) -> Pen:
        """Begin to listen.

        Raises
        ------
        InputError
            For a device, channel or rate that there is not.
        """
        self._child = Child("tactileq.rig.desk.pen_process", input_settings(self._section))
        try:
            self._rate_hz = self._child.ready(Listening).rate_hz
        except ChildLost as lost:
            raise InputError(
                f"expected the accelerometer's process to start, got: {lost}; check its device "
                "(tactileq rig check)."
            ) from None
        return self

    def __exit__(self, *_: object) -> None:
        if self._child is not None:
            self._child.close()

    def begin(self, start_s: float) -> None:
        """Keep what is measured from this moment on (by `now_s`)."""
        self._ask(Begin(start_s), Done)

    def end(self) -> None:
        """Keep no more."""
        self._ask(End(), Done)

    def take(self, opened_s: float) -> tuple[Acceleration, ...]:
        """What was kept since the last call, on the clock of a rig that was opened then."""
        taken = self._ask(Take(), Taken)
        if taken is None:
            return ()
        if not taken.runs:
            self.lost = "its sound server or its device is gone"
        return tuple(
            Acceleration(
                start_s=piece.start_s - opened_s,
                rate_hz=self._rate_hz,
                samples_g=np.frombuffer(piece.samples_g, dtype=np.float32).astype(np.float64),
            )
            for piece in taken.pieces
        )

    def _ask(self, request: Message, kind: type[Reply]) -> Reply | None:
        """The process' answer; none once it is lost, which `lost` then reports."""
        if self._child is None or self.lost:
            return None
        try:
            return self._child.ask(request, kind, within_s=TAKE_S)
        except ChildLost as lost:
            self.lost = str(lost)
            return None
