"""The sound card as the output of a session: textures under the hand, signals, masking noise.

docs/method/live.md#output
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from tactileq.modeling.arrays import Floats
from tactileq.modeling.errors import InputError
from tactileq.modeling.models.ar_model import ARModel
from tactileq.modeling.models.loading import AnyModel
from tactileq.modeling.rendering.lattice import lattice_fields
from tactileq.modeling.rendering.limits import Limits
from tactileq.modeling.rendering.noise import stream_key
from tactileq.modeling.rendering.plan import usual_update_s
from tactileq.modeling.vibrators.compensation import Compensation
from tactileq.modeling.vibrators.exposure import hand_arm_sections
from tactileq.modeling.vibrators.vibrator import Vibrator
from tactileq.rig.devices.sound.messages import (
    Corrected,
    Count,
    Members,
    PlaySignal,
    PlaySurface,
    Silence,
    SoundSettings,
)
from tactileq.rig.devices.sound.supervision import HALTED, SoundLost, SoundProcess
from tactileq.rig.devices.sound.vibration import Counted, Presented, VibrationOutput
from tactileq.rig.shared.live.child import ChildLost
from tactileq.rig.shared.live.memory import Live, Rows
from tactileq.rig.shared.live.messages import Done

LOUDEST_MASKING = 0.5
_MASKING_STREAM = 2**63


class SoundOutput(VibrationOutput):
    """A sound card with a vibrator, played by a process of its own.

    The process may be killed and its sound server may die: what is asked for next starts another
    one, and `faults` reports it.

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
        super().__init__(
            live,
            rate_hz=rate_hz,
            block_s=block / rate_hz,
            limits=limits,
            compensation=compensation,
        )
        self._seed = seed
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
        self._process = SoundProcess(settings, self._played, block_s=self._block_s)

    # --- Open and close ---------------------------------------------------------------------

    def open(self) -> None:
        """Start the process; its stream plays silence."""
        self._process.start()

    def close(self) -> None:
        """Fade to silence and end the process."""
        self._process.close()

    @property
    def pid(self) -> int | None:
        """Number of the process that plays, None where there is none."""
        return self._process.pid

    @property
    def latency_s(self) -> float:
        """Of the output, as PortAudio states it; NaN while it is closed."""
        return self._process.latency_s

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

    def silence(self) -> Counted | None:
        """See `VibrationOutput`."""
        if self._process.reply(Silence(), Done) is None:
            return None
        try:
            self._process.wait(lambda rows: rows["presentation"] == 0)
        except ChildLost as lost:
            self._process.lose(str(lost))
            return None
        return self.counted()

    def counted(self) -> Counted | None:
        """See `VibrationOutput`."""
        corrected = self._process.reply(Count(self._presentation), Corrected)
        if corrected is None or corrected.counters is None:
            return None
        return Counted(presentation=self._presentation, counters=corrected.counters)

    def masking(self, level: float) -> None:
        """See `VibrationOutput`."""
        check_masking(level, possible=self._has_masking)
        self._process.mask(level)

    # --- Health -----------------------------------------------------------------------------

    def faults(self) -> tuple[str, ...]:
        """What went wrong since the last call, one sentence each; a heartbeat for what plays."""
        return self._process.faults()

    def _look(self) -> Rows:
        return self._process.look()

    # --- What both kinds share --------------------------------------------------------------

    def _begin_signal(self, number: int, samples: Floats) -> Presented:
        return self._begin(number, PlaySignal(number, samples.astype(np.float32).tobytes()))

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


def check_masking(level: float, *, possible: bool) -> None:
    """InputError for a masking noise out of range, or without a channel for it."""
    if not 0 <= level <= LOUDEST_MASKING:
        raise InputError(
            f"expected a masking noise of 0 to {LOUDEST_MASKING:g} of full scale, got {level}; "
            "choose one in that range."
        )
    if level > 0 and not possible:
        raise InputError(
            "expected a channel for the masking noise, got none; name masking_channel in the "
            "rig file."
        )
