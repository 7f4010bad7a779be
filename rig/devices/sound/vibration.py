"""What presents vibration: limits, prepared signals, and what was played of them.

docs/method/live.md#output
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from dataclasses import dataclass
from typing import Self

import numpy as np
from numpy.typing import ArrayLike

from tactileq.modeling.arrays import Floats
from tactileq.modeling.models.loading import AnyModel
from tactileq.modeling.rendering.limits import Limits
from tactileq.modeling.rendering.plan import RenderCounters, RenderPlan, plan_for
from tactileq.modeling.vibrators.compensation import Compensation
from tactileq.rig.devices.sound.played import STALLED_S, PlayedBlocks
from tactileq.rig.devices.sound.signal_limits import check_signal, largest_factor
from tactileq.rig.shared.live.clock import now_s, sleep
from tactileq.rig.shared.live.memory import OLDEST_READING_S, Live, Rows


@dataclass(frozen=True, kw_only=True)
class Presented:
    """A presentation that began: its number in the log of blocks, the time of its first sample."""

    presentation: int
    time_s: float


@dataclass(frozen=True, kw_only=True)
class Counted:
    """What rendering a presentation had to correct."""

    presentation: int
    counters: RenderCounters


class VibrationOutput(ABC):
    """A vibrator that a sound card drives, or a device that renders by itself.

    While something plays `faults` has to be called, best ten times a second: where nobody calls it
    for a second what plays is halted, and stays so (docs/method/live.md#heartbeat).

    Parameters
    ----------
    live : Live
        Where what was played is logged.
    rate_hz : float
        Of the output.
    block_s : float
        Duration of a block.
    limits : Limits
    compensation : Compensation, optional
        Undoes the vibrator's resonance; made for this rate.
    """

    def __init__(
        self,
        live: Live,
        *,
        rate_hz: float,
        block_s: float,
        limits: Limits,
        compensation: Compensation | None,
    ) -> None:
        self._live = live
        self._limits, self._compensation, self._rate_hz = limits, compensation, rate_hz
        self._block_s = block_s
        self._played = PlayedBlocks(live, limits, block_s=block_s)
        self._presentation = 0

    # --- What each kind does ----------------------------------------------------------------

    @abstractmethod
    def open(self) -> None:
        """Begin with silence.

        Raises
        ------
        InputError
            If what plays is not there, or does not do what is wanted of it.
        SoundLost
            If it cannot be started.
        """

    @abstractmethod
    def close(self) -> None:
        """Fade to silence and end."""

    @property
    @abstractmethod
    def pid(self) -> int | None:
        """Number of the process that plays, None where there is none."""

    @property
    @abstractmethod
    def latency_s(self) -> float:
        """Of the output, as stated; NaN while it is closed."""

    @abstractmethod
    def play(self, model: AnyModel) -> Presented:
        """Play a texture under the hand, through silence; return when its first sample has left.

        Raises
        ------
        InputError
            For a model that this output cannot render.
        SoundLost
            If nothing can be played.
        """

    @abstractmethod
    def silence(self) -> Counted | None:
        """Fade to silence; return when it has left.

        Returns
        -------
        Counted or None
            Of what played until now; None where nothing did, or its process is gone.
        """

    @abstractmethod
    def counted(self) -> Counted | None:
        """What rendering had to correct so far in what was last begun.

        None of a signal, where nothing was begun, or where its process is gone.
        """

    @abstractmethod
    def masking(self, level: float) -> None:
        """White noise on the masking channel from now on.

        Parameters
        ----------
        level : float
            RMS in shares of full scale, 0 (off) … 0.5.

        Raises
        ------
        InputError
            For a level out of range, or where there is no masking channel.
        """

    @abstractmethod
    def faults(self) -> tuple[str, ...]:
        """What went wrong since the last call, one sentence each; a heartbeat for what plays."""

    @abstractmethod
    def _look(self) -> Rows:
        """Take in the blocks since the last look."""

    @abstractmethod
    def _begin_signal(self, number: int, samples: Floats) -> Presented:
        """Play samples (n,) g as they are."""

    @abstractmethod
    def _wait_for_end(self, number: int, within_s: float) -> None:
        """Until a signal is over; SoundLost where it is halted, or its process lost."""

    # --- What all do ------------------------------------------------------------------------

    def __enter__(self) -> Self:
        self.open()
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    @property
    def halted(self) -> bool:
        """Whether what was presented last was halted, by what `faults` has seen."""
        return self._played.halted

    @property
    def misses(self) -> int:
        """Blocks so far that came too late, according to the driver."""
        self._look()
        return self._played.misses

    def play_signal(
        self, samples_g: ArrayLike, *, compensated: bool = False, wait: bool = False
    ) -> Presented:
        """Play a prepared signal once, whatever the hand does, through silence.

        Where it would make the vibration longer than its limit, it begins after a pause.

        Parameters
        ----------
        samples_g : (n,) array_like
            In g at the card's rate, with its own fades.
        compensated : bool
            Whether the vibrator's resonance has been undone in it already.
        wait : bool
            Return when it is over, instead of when its first sample has left.

        Raises
        ------
        InputError
            For a signal beyond the limits, or with values that are not finite.
        SoundLost
            If nothing can be played; with `wait` also where the process is lost meanwhile, or
            the signal halted.
        """
        samples = self.checked(samples_g, compensated=compensated)
        self._pause_before(samples.size / self._rate_hz)
        number = self._number()
        presented = self._begin_signal(number, samples)
        if wait:
            self._wait_for_end(number, samples.size / self._rate_hz + STALLED_S)
        return presented

    def checked(self, samples_g: ArrayLike, *, compensated: bool = False) -> Floats:
        """What would leave for a signal, (n,) g; needs no device. Refused as by `play_signal`."""
        samples = np.asarray(samples_g, dtype=np.float64)
        if self._compensation is not None and not compensated:
            samples = self._compensation.apply(samples)
        check_signal(samples, self._plan(self._rate_hz))
        return samples

    def largest_factor(self, samples_g: ArrayLike) -> float:
        """How many times a signal (n,) g can be played within the limits; needs no device.

        Infinite without limits of peak and RMS, and for silence.
        """
        samples = np.asarray(samples_g, dtype=np.float64)
        if self._compensation is not None:
            samples = self._compensation.apply(samples)
        return largest_factor(samples, self._plan(self._rate_hz))

    def _pause_before(self, seconds: float) -> None:
        """Fall silent for a pause where so much more would be longer than the limit."""
        self._look()
        if self._played.pause_needed(seconds):
            self.silence()
            sleep(max(0.0, self._played.silent_until_s - now_s()))

    def _number(self) -> int:
        self._presentation += 1
        return self._presentation

    def _plan(self, model_rate_hz: float, update_s: float = 1e-3) -> RenderPlan:
        return plan_for(
            model_rate_hz,
            rate_hz=self._rate_hz,
            update_s=update_s,
            limits=self._limits,
            compensation=self._compensation,
            hold_s=OLDEST_READING_S + self._block_s,
        )
