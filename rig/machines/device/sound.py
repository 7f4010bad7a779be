"""A device that renders by itself in place of the sound card: textures and signals of a session.

docs/device.md#texture
"""

from __future__ import annotations

from collections.abc import Callable
from contextlib import ExitStack
from dataclasses import replace
from typing import Any, TypeVar

import numpy as np

from tactileq.modeling.arrays import Floats
from tactileq.modeling.errors import InputError
from tactileq.modeling.models.loading import AnyModel
from tactileq.modeling.rendering.limits import Limits
from tactileq.modeling.vibrators.compensation import Compensation
from tactileq.rig.devices.sound.output import SoundOutput, check_masking
from tactileq.rig.devices.sound.played import STALLED_S
from tactileq.rig.devices.sound.supervision import HALTED, SoundLost
from tactileq.rig.devices.sound.vibration import Counted, Presented, VibrationOutput
from tactileq.rig.machines.device.hand import DeviceHand
from tactileq.rig.machines.device.messages import (
    CountCorrections,
    Describe,
    PlayModel,
    PlaySamples,
    StopPlaying,
)
from tactileq.rig.machines.device.models import ANY_DEVICE, device_model
from tactileq.rig.shared.live.child import ChildLost
from tactileq.rig.shared.live.clock import now_s, sleep
from tactileq.rig.shared.live.memory import Live, Rows
from tactileq.rig.shared.setup.rig_file import DEVICE_BLOCK_S, DEVICE_RATE_HZ

_POLL_S = 0.001
Answer = TypeVar("Answer")


class DeviceSound(VibrationOutput):
    """What a device plays; the masking noise is still a sound card's.

    Parameters
    ----------
    hand : DeviceHand
        Its `Vibration` given, of this peak and scale.
    opens : bool
        Whether this opens the hand and closes it.
    scale : float
        What the device's converter is given for 1 g.
    limits : Limits
        All of them finite.
    compensation : Compensation, optional
        Made for the device's rate.
    masked : callable, optional
        Gives the output of a sound card that plays the masking noise; None where there is none.
    """

    def __init__(
        self,
        live: Live,
        hand: DeviceHand,
        *,
        opens: bool,
        scale: float,
        limits: Limits,
        compensation: Compensation | None = None,
        masked: Callable[[Live], SoundOutput] | None = None,
    ) -> None:
        super().__init__(
            live,
            rate_hz=DEVICE_RATE_HZ,
            block_s=DEVICE_BLOCK_S,
            limits=limits,
            compensation=compensation,
        )
        self._hand, self._opens, self._scale = hand, opens, scale
        self._masked = masked
        self._masking: SoundOutput | None = None
        self._stack = ExitStack()
        self._plays = False
        self._faults: list[str] = []

    def open(self) -> None:
        """Begin with silence; InputError where the vibrator's converter cannot give the peak."""
        with ExitStack() as stack:
            if self._opens:
                stack.enter_context(self._hand)
            most = self._lost(lambda: self._hand.ask(Describe())).most_g
            check_reach(most, self._limits, scale=self._scale)
            self._played.begin()
            self._stack = stack.pop_all()

    def close(self) -> None:
        """Fade to silence; give back what this has opened."""
        if self._plays:
            self.silence()
        self._masking = None
        self._stack.close()

    @property
    def pid(self) -> int | None:
        """Number of the process that talks to the device."""
        return self._hand.pid

    @property
    def latency_s(self) -> float:
        """From the device's reading of its encoders to the vibration: a tick."""
        return 1 / DEVICE_RATE_HZ

    # --- What plays -------------------------------------------------------------------------

    def play(self, model: AnyModel) -> Presented:
        """See `VibrationOutput`; InputError as `device_model`."""
        number = self._number()

        real_size = self._lost(lambda: self._hand.ask(Describe())).real_size
        upload = device_model(
            model,
            replace(ANY_DEVICE, real_size=real_size),
            limits=self._limits,
            compensation=self._compensation,
        )
        return self._begin(
            number, PlayModel(presentation=number, data=upload.data, digest=upload.hash)
        )

    def _begin_signal(self, number: int, samples: Floats) -> Presented:
        data = samples.astype(np.float32).tobytes()
        return self._begin(number, PlaySamples(presentation=number, samples=data))

    def _begin(self, number: int, wanted: PlayModel | PlaySamples) -> Presented:
        self._lost(lambda: self._hand.ask(wanted))
        self._plays = True
        row = self._lost(lambda: self._wait(lambda rows: rows["presentation"] == number))
        return Presented(presentation=number, time_s=float(row["dac_time_s"]))

    def silence(self) -> Counted | None:
        """See `VibrationOutput`."""
        self._plays = False
        try:
            self._hand.ask(StopPlaying())
            self._wait(lambda rows: rows["presentation"] == 0)
        except (ChildLost, InputError):
            return None  # the hand's faults say why
        return self.counted()

    def counted(self) -> Counted | None:
        """See `VibrationOutput`."""
        try:
            counters = self._hand.ask(CountCorrections(self._presentation)).counters
        except (ChildLost, InputError):
            return None
        if counters is None:
            return None
        return Counted(presentation=self._presentation, counters=counters)

    def masking(self, level: float) -> None:
        """See `VibrationOutput`; the sound card is opened with the first noise."""
        check_masking(level, possible=self._masked is not None)
        if self._masking is None and level > 0 and self._masked is not None:
            live = self._stack.enter_context(Live.create())
            self._masking = self._stack.enter_context(self._masked(live))
        if self._masking is not None:
            self._masking.masking(level)

    # --- Health -----------------------------------------------------------------------------

    def faults(self) -> tuple[str, ...]:
        """See `VibrationOutput`; of the link to the device the hand's `faults` tell."""
        self._look()
        faults, self._faults = self._faults, []
        if self._masking is not None:
            faults += self._masking.faults()
        return tuple(faults)

    def _look(self) -> Rows:
        rows, halts = self._played.look()
        self._faults += [HALTED] * halts
        return rows

    def _wait(self, found: Callable[[Rows], Any], *, within_s: float = 2 * STALLED_S) -> np.void:
        """The first new block for which this holds; ChildLost where none comes."""
        end_s = now_s() + within_s
        while now_s() < end_s:
            rows = self._look()
            fitting = rows[np.asarray(found(rows), dtype=bool)]
            if fitting.size:
                return fitting[0]  # type: ignore[no-any-return]
            sleep(_POLL_S)
        raise ChildLost("its device plays nothing")

    def _wait_for_end(self, number: int, within_s: float) -> None:
        self._lost(
            lambda: self._wait(lambda rows: rows["presentation"] != number, within_s=within_s)
        )
        if self._played.halted:
            raise SoundLost(HALTED)

    def _lost(self, ask: Callable[[], Answer]) -> Answer:
        """What this gives; SoundLost where the process or the device is gone."""
        try:
            return ask()
        except ChildLost as lost:
            raise SoundLost(
                f"expected a device that plays, got: {lost}; check it (tactileq rig check)."
            ) from None


def check_reach(most: float, limits: Limits, *, scale: float) -> None:
    """Refuse limits that a converter which takes so much cannot give, `scale` being 1 g."""
    if limits.peak * scale > most:
        raise InputError(
            f"expected a peak limit of at most {most / scale:.4g} g, which is full scale of the "
            f"device, got {limits.peak:g} g; lower it in the rig file."
        )
