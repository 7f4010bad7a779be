"""The output of a session: textures under the hand, prepared signals, masking noise.

docs/method/live.md#output
"""

from __future__ import annotations

import time
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from modeling.arrays import Floats
from modeling.errors import InputError
from modeling.models.ar_model import ARModel
from modeling.models.loading import AnyModel
from modeling.rendering.lattice import lattice_fields
from modeling.rendering.limits import Limits
from modeling.rendering.noise import stream_key
from modeling.rendering.plan import RenderCounters, RenderPlan, plan_for, usual_update_s
from modeling.vibrators.compensation import Compensation
from modeling.vibrators.exposure import hand_arm_sections
from modeling.vibrators.vibrator import Vibrator
from rig.live.child import ChildLost
from rig.live.memory import (
    OLDEST_READING_S,
    Live,
    now_s,
)
from rig.live.messages import Done
from rig.sound.messages import (
    Corrected,
    Count,
    Members,
    PlaySignal,
    PlaySurface,
    Silence,
    SoundSettings,
)
from rig.sound.played import STALLED_S, PlayedBlocks
from rig.sound.signal_limits import check_signal, largest_factor
from rig.sound.supervision import HALTED, SoundLost, SoundProcess

LOUDEST_MASKING = 0.5
_MASKING_STREAM = 2**63


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


class SoundOutput:
    """A sound card with a vibrator, played by a process of its own.

    The process may be killed and its sound server may die: what is asked for next starts another
    one, and `faults` reports it.

    While something plays `faults` has to be called, best ten times a second: where nobody calls it
    for a second what plays is halted, and stays so (docs/method/live.md#heartbeat).

    Parameters
    ----------
    live : Live
        Where the hand comes from and what was played is logged.
    device : str, optional
        Name of the sound device, or a part of it; the system's usual one without it.
    rate_hz : float
        At least the models' rate.
    block : int
        Samples between two calls of the callback, 16 … 4096; the hand is held for as long.
    vibration_channel, masking_channel : int
        From 0; no masking where None.
    fullscale_per_g : float
        Above 0; the calibration.
    limits : Limits
        With a finite peak that the card can play.
    compensation : Compensation, optional
        Undoes the vibrator's resonance; made for this rate.
    seed : int
        Of all noise.
    vibrator : Vibrator, optional
        Whose resonance the exposure of the hand is to count in.

    Raises
    ------
    InputError
        For limits without a peak, or one beyond full scale; channels that do not exist.
    """

    def __init__(
        self,
        live: Live,
        *,
        device: str | None,
        rate_hz: float,
        block: int,
        channels: int = 2,
        vibration_channel: int = 0,
        masking_channel: int | None = None,
        fullscale_per_g: float,
        limits: Limits,
        compensation: Compensation | None = None,
        seed: int = 0,
        vibrator: Vibrator | None = None,
    ) -> None:
        _check_channels(channels, vibration_channel, masking=masking_channel)
        _check_level(fullscale_per_g, limits)
        if not 16 <= block <= 4096:
            raise InputError(f"expected a block of 16 to 4096 samples, got {block}; choose 128.")
        self._live, self._seed = live, seed
        self._limits, self._compensation, self._rate_hz = limits, compensation, rate_hz
        self._has_masking = masking_channel is not None
        settings = SoundSettings(
            live=str(live.path),
            device=device,
            rate_hz=rate_hz,
            block=block,
            channels=channels,
            vibration_channel=vibration_channel,
            masking_channel=masking_channel,
            fullscale_per_g=fullscale_per_g,
            masking_key=int(stream_key(seed, _MASKING_STREAM)),
            weighting=hand_arm_sections(rate_hz, vibrator=vibrator).tobytes(),
        )
        self._block_s = block / rate_hz
        self._played = PlayedBlocks(live, limits, block_s=self._block_s)
        self._process = SoundProcess(settings, self._played, block_s=self._block_s)
        self._presentation = 0

    # --- Open and close ---------------------------------------------------------------------

    def open(self) -> None:
        """Start the process; its stream plays silence.

        Raises
        ------
        InputError
            If the device is not there, or does not do what is wanted of it.
        SoundLost
            If it cannot be started.
        """
        self._process.start()

    def close(self) -> None:
        """Fade to silence and end the process."""
        self._process.close()

    def __enter__(self) -> SoundOutput:
        self.open()
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    @property
    def pid(self) -> int | None:
        """Number of the process that plays, None where there is none."""
        return self._process.pid

    @property
    def latency_s(self) -> float:
        """Of the output, as PortAudio states it; NaN while it is closed."""
        return self._process.latency_s

    @property
    def halted(self) -> bool:
        """Whether what was presented last was halted, by what `faults` has seen."""
        return self._played.halted

    @property
    def misses(self) -> int:
        """Blocks so far that came too late, according to the driver."""
        self._process.look()
        return self._played.misses

    # --- What plays -------------------------------------------------------------------------

    def play(self, model: AnyModel) -> Presented:
        """Play a texture under the hand, through silence; return when its first sample has left.

        Parameters
        ----------
        model : TextureModel, RegressedModel or ARModel
            Of a rate up to the card's. It is rendered at its own rate and interpolated, which adds
            a delay: docs/method/rendering.md#other-rates

        Raises
        ------
        InputError
            For a model of a higher rate; for an ARModel that `lattice_fields` refuses.
        SoundLost
            If nothing can be played.
        """
        number = self._number()
        plan = self._plan(model.rate_hz, usual_update_s(model))
        lattice = None
        if isinstance(model, ARModel):
            fields = lattice_fields(model, plan)
            texture, lattice = _members(fields.texture), _members(fields.lattice)
        else:
            texture = _members(plan.texture(model))
        key = int(stream_key(self._seed, number))
        wanted = PlaySurface(presentation=number, key=key, texture=texture, lattice=lattice)
        return self._begin(number, wanted)

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
        presented = self._begin(number, PlaySignal(number, samples.astype(np.float32).tobytes()))
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

    def silence(self) -> Counted | None:
        """Fade to silence; return when it has left.

        Returns
        -------
        Counted or None
            Of what played until now; None where nothing did, or its process is gone.
        """
        if self._process.reply(Silence(), Done) is None:
            return None
        try:
            self._process.wait(lambda rows: rows["presentation"] == 0)
        except ChildLost as lost:
            self._process.lose(str(lost))
            return None
        return self.counted()

    def counted(self) -> Counted | None:
        """What rendering had to correct so far in what was last begun.

        None of a signal, where nothing was begun, or where its process is gone.
        """
        corrected = self._process.reply(Count(self._presentation), Corrected)
        if corrected is None or corrected.counters is None:
            return None
        return Counted(presentation=self._presentation, counters=corrected.counters)

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
        if not 0 <= level <= LOUDEST_MASKING:
            raise InputError(
                f"expected a masking noise of 0 to {LOUDEST_MASKING:g} of full scale, got {level}; "
                "choose one in that range."
            )
        if not self._has_masking and level > 0:
            raise InputError(
                "expected a channel for the masking noise, got none; name masking_channel in the "
                "rig file."
            )
        self._process.mask(level)

    # --- Health -----------------------------------------------------------------------------

    def faults(self) -> tuple[str, ...]:
        """What went wrong since the last call, one sentence each; a heartbeat for what plays."""
        return self._process.faults()

    def _pause_before(self, seconds: float) -> None:
        """Fall silent for a pause where so much more would be longer than the limit."""
        self._process.look()
        if self._played.pause_needed(seconds):
            self.silence()
            time.sleep(max(0.0, self._played.silent_until_s - now_s()))

    # --- What both kinds share --------------------------------------------------------------

    def _begin(self, number: int, wanted: PlaySurface | PlaySignal) -> Presented:
        row = self._process.begin(wanted, number)
        return Presented(presentation=number, time_s=float(row["dac_time_s"]))

    def _wait_for_end(self, number: int, within_s: float) -> None:
        try:
            self._process.wait(lambda rows: rows["presentation"] != number, within_s=within_s)
        except ChildLost as lost:
            self._process.lose(str(lost))
            raise SoundLost(
                f"expected a sound process that plays to the end, got: {lost}; play it again."
            ) from None
        if self._played.halted:
            raise SoundLost(HALTED)

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


def _members(fields: Mapping[str, Any]) -> Members:
    """Members of a structure, as a message holds them."""
    return {
        name: value.astype(np.float64).tobytes() if isinstance(value, np.ndarray) else value
        for name, value in fields.items()
    }


def _check_channels(channels: int, vibration: int, *, masking: int | None) -> None:
    numbers = [vibration] if masking is None else [vibration, masking]
    if not all(0 <= number < channels for number in numbers) or len({*numbers}) < len(numbers):
        raise InputError(
            f"expected different channels from 0 to {channels - 1} for vibration and masking, got "
            f"{vibration} and {masking}; correct the rig file."
        )


def _check_level(fullscale_per_g: float, limits: Limits) -> None:
    if not (0 < fullscale_per_g < np.inf):
        raise InputError(
            f"expected full scale per g above 0, got {fullscale_per_g}; calibrate the rig."
        )
    if limits.peak * fullscale_per_g > 1:
        raise InputError(
            f"expected a peak limit of at most {1 / fullscale_per_g:.4g} g, which is full scale of "
            f"the sound card, got {limits.peak:g} g; lower it in the rig file."
        )
