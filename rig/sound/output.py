"""The output of a session: textures under the hand, prepared signals, masking noise.

docs/method/live.md#output
"""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from modeling.arrays import Floats
from modeling.errors import InputError
from modeling.models.ar_model import ARModel
from modeling.models.loading import AnyModel
from modeling.rendering.lattice import lattice_fields
from modeling.rendering.limits import Limits
from modeling.rendering.noise import stream_key
from modeling.rendering.plan import RenderCounters, RenderPlan, plan_for, usual_update_s
from modeling.vibrators.compensation import Compensation
from rig.live.child import Child, ChildLost, Reply
from rig.live.memory import (
    HEARTBEAT_S,
    NO_HEARTBEAT,
    OLDEST_READING_S,
    UNDERFLOW,
    Live,
    Rows,
    now_s,
)
from rig.live.messages import Done
from rig.sound.messages import (
    Corrected,
    Count,
    Mask,
    Members,
    Playing,
    PlaySignal,
    PlaySurface,
    Silence,
    SoundSettings,
)

STALLED_S = 0.5  # without a block: the server is gone
LOUDEST_MASKING = 0.5
_MASKING_STREAM = 2**63
_POLL_S = 0.001
_HALTED = (
    f"expected the program to poll the rig at least every {HEARTBEAT_S:g} s, got a longer "
    "time without; the vibration was stopped, and nothing is felt until something is presented "
    "again."
)


class SoundLost(OSError):
    """Nothing can be played, or not to its end; the message is one sentence."""


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
    channels : int
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
    ) -> None:
        _check_channels(channels, vibration_channel, masking=masking_channel)
        _check_level(fullscale_per_g, limits)
        if not 16 <= block <= 4096:
            raise InputError(f"expected a block of 16 to 4096 samples, got {block}; choose 128.")
        self._live, self._seed = live, seed
        self._limits, self._compensation, self._rate_hz = limits, compensation, rate_hz
        self._has_masking = masking_channel is not None
        self._masking = 0.0
        self._settings = SoundSettings(
            live=str(live.path),
            device=device,
            rate_hz=rate_hz,
            block=block,
            channels=channels,
            vibration_channel=vibration_channel,
            masking_channel=masking_channel,
            fullscale_per_g=fullscale_per_g,
            masking_key=int(stream_key(seed, _MASKING_STREAM)),
        )
        self._block_s = block / rate_hz
        self._child: Child | None = None
        self._latency_s = float("nan")
        self._faults: list[str] = []
        self._presentation = 0
        self._seen = live.blocks_written
        self._last_block_s = 0.0
        self._misses = 0
        self._halted = False
        # The vibration that has had no pause yet: since when and until when it was felt.
        self._felt_since_s = self._felt_until_s = 0.0

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
        if self._child is None:
            self._start()

    def close(self) -> None:
        """Fade to silence and end the process."""
        if self._child is not None:
            self._child.close()
            self._child = None

    def __enter__(self) -> SoundOutput:
        self.open()
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    @property
    def pid(self) -> int | None:
        """Number of the process that plays, None where there is none."""
        return None if self._child is None else self._child.pid

    @property
    def latency_s(self) -> float:
        """Of the output, as PortAudio states it; NaN while it is closed."""
        return float("nan") if self._child is None else self._latency_s

    @property
    def halted(self) -> bool:
        """Whether what was presented last was halted, by what `faults` has seen."""
        return self._halted

    @property
    def misses(self) -> int:
        """Blocks so far that came too late, according to the driver."""
        self._look()
        return self._misses

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
        if self._child is None:
            return None
        try:
            self._child.ask(Silence(), Done)
            self._wait(lambda rows: rows["presentation"] == 0)
        except ChildLost as lost:
            self._lose(str(lost))
            return None
        return self.counted()

    def counted(self) -> Counted | None:
        """What rendering had to correct so far in what was last begun.

        None of a signal, where nothing was begun, or where its process is gone.
        """
        corrected = self._reply(Count(self._presentation), Corrected)
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
        self._masking = level
        self._reply(Mask(level), Done)  # if it is lost, the next process begins with this level

    # --- Health -----------------------------------------------------------------------------

    def faults(self) -> tuple[str, ...]:
        """What went wrong since the last call, one sentence each; a heartbeat for what plays."""
        self._look()
        if self._child is not None and not self._child.runs:
            self._lose("it has ended")
        elif self._child is not None and now_s() - self._last_block_s > STALLED_S:
            self._lose(f"no block for {STALLED_S:g} s, so its server is gone or suspended")
        faults, self._faults = tuple(self._faults), []
        return faults

    def _look(self) -> Rows:
        """The blocks since the last look, counted; who looks is there, which is the heartbeat."""
        self._live.heartbeat()
        self._seen, rows = self._live.blocks_since(self._seen)
        if rows.size:
            self._last_block_s = float(rows["time_s"][-1])
            self._misses += int(np.count_nonzero(rows["flags"] & UNDERFLOW))
            self._follow_halts((rows["flags"] & NO_HEARTBEAT) > 0)
            self._follow_vibration(rows)
        return rows

    def _follow_halts(self, halted: NDArray[np.bool_]) -> None:
        """Report each halt once; (n,), whether it holds in each block."""
        before = np.concatenate(([self._halted], halted[:-1]))
        self._faults += [_HALTED] * int(np.count_nonzero(halted & ~before))
        self._halted = bool(halted[-1])

    def _follow_vibration(self, rows: Rows) -> None:
        """Since when, and until when, it was felt without a pause."""
        felt_s = rows["time_s"][rows["peak_g"] > self._limits.silence]
        if not felt_s.size:
            return
        before_s = np.concatenate(([self._felt_until_s], felt_s[:-1] + self._block_s))
        pauses = np.flatnonzero(felt_s - before_s >= self._limits.pause_s)
        if pauses.size:
            self._felt_since_s = float(felt_s[pauses[-1]])
        self._felt_until_s = float(felt_s[-1]) + self._block_s

    def _pause_before(self, seconds: float) -> None:
        """Fall silent for a pause where so much more would be longer than the limit."""
        self._look()
        pause_s = self._limits.pause_s + 2 * self._block_s
        felt_s = self._felt_until_s - self._felt_since_s
        if felt_s + seconds <= self._limits.duration_s or now_s() > self._felt_until_s + pause_s:
            return
        self.silence()
        time.sleep(max(0.0, self._felt_until_s + pause_s - now_s()))

    def _lose(self, why: str) -> None:
        self._faults.append(
            f"expected the sound process to play, got: {why}; nothing is felt until something is "
            "presented again, by another process."
        )
        if self._child is not None:
            self._child.kill()
            self._child = None

    # --- The process ------------------------------------------------------------------------

    def _start(self) -> Child:
        child = Child("rig.sound.process", self._settings)
        try:
            self._latency_s = child.ready(Playing).latency_s
            self._child, self._last_block_s = child, now_s()
            self._wait(lambda rows: rows["frames"] > 0)
            if self._masking:
                child.ask(Mask(self._masking), Done)
            return child
        except ChildLost as lost:
            self.close()
            raise SoundLost(
                f"expected a sound process that plays, got: {lost}; check the sound device "
                "(tactileq rig check)."
            ) from None

    def _reply(self, request: Count | Mask, kind: type[Reply]) -> Reply | None:
        """The process' answer; None where there is no process, or it is lost."""
        try:
            return None if self._child is None else self._child.ask(request, kind)
        except ChildLost as lost:
            self._lose(str(lost))
            return None

    def _begin(self, number: int, wanted: PlaySurface | PlaySignal) -> Presented:
        """Ask for something and wait for its first sample; once more where the process is lost."""
        for _ in range(2):
            try:
                (self._child or self._start()).ask(wanted, Done)
                row = self._wait(lambda rows: rows["presentation"] == number)
                return Presented(presentation=number, time_s=float(row["dac_time_s"]))
            except ChildLost as lost:
                self._lose(str(lost))
            except InputError as error:  # of a new process: the device has changed
                raise SoundLost(str(error)) from None
        raise SoundLost(
            "expected a sound process that plays, got two that did not; check the sound device "
            "(tactileq rig check)."
        )

    def _wait(self, found: Callable[[Rows], Any], *, within_s: float = STALLED_S + 0.5) -> np.void:
        """The first new block for which this holds, once its first sample has left."""
        end_s = now_s() + within_s + 4 * self._block_s
        while now_s() < end_s:
            rows = self._look()
            fitting = rows[np.asarray(found(rows), dtype=bool)]
            if fitting.size:
                time.sleep(max(0.0, float(fitting[0]["dac_time_s"]) - now_s()))
                return fitting[0]  # type: ignore[no-any-return]
            if self._child is not None and not self._child.runs:
                raise ChildLost("it has ended")
            time.sleep(_POLL_S)
        raise ChildLost("it plays no blocks")

    def _wait_for_end(self, number: int, within_s: float) -> None:
        try:
            self._wait(lambda rows: rows["presentation"] != number, within_s=within_s)
        except ChildLost as lost:
            self._lose(str(lost))
            raise SoundLost(
                f"expected a sound process that plays to the end, got: {lost}; play it again."
            ) from None
        if self._halted:
            raise SoundLost(_HALTED)

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


def check_signal(samples: Floats, plan: RenderPlan) -> None:
    """InputError where a prepared signal is beyond the limits of a plan.

    The running mean square is taken to be at its limit when the signal begins, whatever was felt
    before.
    """
    if samples.ndim != 1 or not samples.size or not np.isfinite(samples).all():
        what = "NaN or inf" if samples.ndim == 1 and samples.size else f"shape {samples.shape}"
        raise InputError(f"expected a signal as (n,) finite numbers in g, got {what}; correct it.")
    limits = plan.limits
    peak = float(np.abs(samples).max())
    if peak > limits.peak:
        raise InputError(
            f"expected a signal of at most {limits.peak:g} g, got {peak:.4g} g; lower it or raise "
            "the rig's limit."
        )
    if np.isfinite(limits.rms):
        squares = _mean_squares(samples, plan) + _left_of_limit(samples.size, plan)
        if squares.max() > limits.mean_square * (1 + 1e-9):
            raise InputError(
                f"expected a signal with a running RMS of at most {limits.rms:g} g, got "
                f"{np.sqrt(squares.max()):.4g} g; lower it or raise the rig's limit."
            )
    longest = _longest_run(np.abs(samples) > limits.silence, plan.samples(limits.pause_s))
    if np.isfinite(limits.duration_s) and longest > plan.samples(limits.duration_s):
        raise InputError(
            f"expected a signal of at most {limits.duration_s:g} s without a pause, got "
            f"{longest / plan.rate_hz:.4g} s; shorten it or raise the rig's limit."
        )


def largest_factor(samples: Floats, plan: RenderPlan) -> float:
    """The largest factor by which a signal (n,) may be multiplied; refused above by `check_signal`.

    Limits of peak and running RMS count, not that of the duration.
    """
    peak = float(np.abs(samples).max(initial=0.0))
    if not peak:
        return float("inf")
    factor = plan.limits.peak / peak
    if np.isfinite(plan.limits.rms):
        room = plan.limits.mean_square - _left_of_limit(samples.size, plan)
        squares = _mean_squares(samples, plan)
        felt = squares > 0
        factor = min(factor, float(np.sqrt((room[felt] / squares[felt]).min())))
    return float(factor)


def _mean_squares(samples: Floats, plan: RenderPlan) -> Floats:
    """Running mean squares (g²) of a signal after silence, (n,)."""
    from scipy.signal import lfilter

    return np.asarray(lfilter([plan.mean_share], [1, plan.mean_share - 1], samples**2))


def _left_of_limit(count: int, plan: RenderPlan) -> Floats:
    """What is left, sample by sample, of a running mean square that was at its limit before."""
    kept = (1.0 - plan.mean_share) ** np.arange(1, count + 1, dtype=np.float64)
    return np.asarray(plan.limits.mean_square * kept)


def _longest_run(loud: np.ndarray[Any, np.dtype[np.bool_]], pause: int) -> int:
    """Samples from the first to the last loud one, where no pause is between."""
    where = np.flatnonzero(loud)
    if not where.size:
        return 0
    begins = np.concatenate([[0], np.flatnonzero(np.diff(where) > pause) + 1])
    ends = np.concatenate([begins[1:] - 1, [where.size - 1]])
    return int((where[ends] - where[begins]).max()) + 1


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
