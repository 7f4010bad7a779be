"""The acceleration that is measured at the pen while something is presented."""

from __future__ import annotations

import tempfile
from contextlib import ExitStack
from dataclasses import asdict
from pathlib import Path
from typing import Any

import numpy as np

from modeling import InputError
from rig.desk.parts import input_settings
from rig.interface import Acceleration
from rig.live.child import Child, ChildLost
from rig.setup.sections import AccelerometerSection

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
        self._stack = ExitStack()
        self._child: Child | None = None
        self._rate_hz = 0.0
        self._folder = Path()
        self.lost = ""

    def __enter__(self) -> Pen:
        """Begin to listen.

        Raises
        ------
        InputError
            For a device, channel or rate that there is not.
        """
        with ExitStack() as stack:
            self._folder = Path(stack.enter_context(tempfile.TemporaryDirectory()))
            settings = {"input": asdict(input_settings(self._section)), "folder": str(self._folder)}
            try:
                self._child = Child("rig.desk.pen_process", settings)
            except ChildLost as lost:
                raise InputError(
                    f"expected the accelerometer's process to start, got: {lost}; check its device "
                    "(tactileq rig check)."
                ) from None
            stack.callback(self._child.close)
            self._rate_hz = float(self._child.ready["rate_hz"])
            self._stack = stack.pop_all()
        return self

    def __exit__(self, *_: object) -> None:
        self._stack.close()

    def begin(self, start_s: float) -> None:
        """Keep what is measured from this moment on (by `now_s`)."""
        self._ask({"do": "begin", "start_s": start_s})

    def end(self) -> None:
        """Keep no more."""
        self._ask({"do": "end"})

    def take(self, opened_s: float) -> tuple[Acceleration, ...]:
        """What was kept since the last call, on the clock of a rig that was opened then."""
        reply = self._ask({"do": "take"})
        if not reply.get("runs", False):
            self.lost = self.lost or "its sound server or its device is gone"
        return tuple(
            Acceleration(
                start_s=piece["start_s"] - opened_s,
                rate_hz=self._rate_hz,
                samples_g=np.load(piece["file"]).astype(np.float64),
            )
            for piece in reply.get("pieces", ())
        )

    def _ask(self, wanted: dict[str, Any]) -> dict[str, Any]:
        """The process' answer; none once it is lost, which `lost` then reports."""
        if self._child is None or self.lost:
            return {}
        try:
            return self._child.ask(wanted, within_s=TAKE_S)
        except ChildLost as lost:
            self.lost = str(lost)
            return {}
