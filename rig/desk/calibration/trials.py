"""Trials of latency: a scripted hand that steps, or any hand that strokes.

docs/method/rig.md#latency
"""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from tactileq.modeling.arrays import Floats
from tactileq.modeling.errors import InputError
from tactileq.modeling.models.texture_model import TextureModel
from tactileq.modeling.seeds import generator
from tactileq.rig.desk.calibration.alignment import aligned
from tactileq.rig.desk.calibration.latency import LAG_BIN_S, high_passed, onset_s, stroke_lag_s
from tactileq.rig.desk.calibration.measuring import Accelerometer, PlaysSignals, Record
from tactileq.rig.desk.calibration.signals import noise_signal
from tactileq.rig.shared.live.memory import Live

MODEL_RATE_HZ = 5000.0
STEP_SPEED_MM_S = 150.0
STEP_FORCE_N = 1.0
# Below this speed the level is proportional to speed, as below any model's grid.
LOWEST_SPEED_MM_S = 300.0
FIRST_REST_S, MOVING_S = 0.5, 0.08
REST_S = (0.12, 0.2)  # not in step with blocks; longer than any latency that is accepted
REST_LOOKED_AT_S = 0.04
MORE = 1.2  # trials than wanted: in some, samples are lost
AT_REST_MM = 1e-9
LONGEST_LAG_S = 0.1
TRIAL_STROKE_S = 0.5  # and the longest lag before it
LEAST_SPEED_MM_S = 40.0
LOOP_BACKS = 5
EARLIEST_S = 1e-3  # to which clocks of input and output agree
_POLL_S = 0.05


def probe_texture(rms_g: float) -> TextureModel:
    """A noise whose level follows the speed: `rms_g` at 150 mm/s, whatever the force."""
    gain = rms_g * LOWEST_SPEED_MM_S / STEP_SPEED_MM_S
    return TextureModel(
        texture="latency test",
        rate_hz=MODEL_RATE_HZ,
        speeds_mm_s=np.array([LOWEST_SPEED_MM_S, 2 * LOWEST_SPEED_MM_S]),
        forces_n=np.array([0.05, 5.0]),
        noise_gains=np.full((2, 2), gain),
        frequencies_hz=np.zeros((2, 2, 0)),
        bandwidths_hz=np.zeros((2, 2, 0)),
        gains=np.zeros((2, 2, 0)),
        level_sd_db=np.zeros((2, 2, 0)),
        estimator="test",
        simulated=True,
    )


def write_steps(path: Path, trials: int, *, seed: int) -> float:
    """A table for a scripted hand: a fifth more steps than so many, back and forth.

    Returns
    -------
    float
        Seconds until the last has ended.
    """
    rests = generator(seed).uniform(*REST_S, size=round(MORE * trials))
    rows, now, x_mm = ["time_s\tx_mm\ty_mm\tforce_n"], 0.0, 0.0
    rows.append(f"0\t0\t0\t{STEP_FORCE_N}")
    for number, rest in enumerate(rests):
        now += rest + (FIRST_REST_S if number == 0 else 0.0)
        rows.append(f"{now:.6f}\t{x_mm:.6f}\t0\t{STEP_FORCE_N}")
        now += MOVING_S
        x_mm += (-1) ** number * STEP_SPEED_MM_S * MOVING_S
        rows.append(f"{now:.6f}\t{x_mm:.6f}\t0\t{STEP_FORCE_N}")
    rows.append(f"{now + FIRST_REST_S:.6f}\t{x_mm:.6f}\t0\t{STEP_FORCE_N}")
    path.write_text("\n".join(rows) + "\n", encoding="utf-8")
    return now + FIRST_REST_S


@dataclass(frozen=True, eq=False)
class Watched:
    """All that happened over some time: the accelerometer, the hand, the blocks."""

    records: list[Record]
    readings: np.ndarray
    blocks: np.ndarray


def watched(
    live: Live, accelerometer: Accelerometer, seconds: float, *, tick: Callable[[float], None]
) -> Watched:
    """Log everything for some time and keep the rig playing; `tick` gets the share elapsed."""
    accelerometer.forget()
    reading, block = live.readings_written, live.blocks_written
    readings, blocks = [], []
    start = time.monotonic()
    while (share := (time.monotonic() - start) / seconds) < 1:
        tick(share)
        live.heartbeat()
        time.sleep(_POLL_S)
        reading, rows = live.readings_since(reading)
        readings.append(rows)
        block, rows = live.blocks_since(block)
        blocks.append(rows)
    live.heartbeat()  # what follows may take a while
    return Watched(accelerometer.stretches(), np.concatenate(readings), np.concatenate(blocks))


def step_latencies_s(seen: Watched) -> list[float | None]:
    """Of each step of a scripted hand that was recorded whole, from its first movement on.

    None where no vibration began.
    """
    filtered = [
        Record(high_passed(r.samples_g, rate_hz=r.rate_hz), r.time_s, r.rate_hz)
        for r in seen.records
    ]
    latencies: list[float | None] = []
    for start_s in steps_of(seen.readings["time_s"], seen.readings["x_mm"]):
        for record in filtered:
            rest = record.between(start_s - REST_LOOKED_AT_S, start_s)
            moving = record.between(start_s, start_s + MOVING_S)
            whole = rest.size + moving.size >= 0.99 * (REST_LOOKED_AT_S + MOVING_S) * record.rate_hz
            if whole:
                latencies.append(onset_s(rest, moving, rate_hz=record.rate_hz))
    return latencies


def steps_of(times_s: Floats, x_mm: Floats) -> Floats:
    """When a scripted hand began to move, each time, to the accuracy of its own clock.

    Constant speed leads from each of a stroke's first readings back to its beginning; what was
    repeated from an earlier sample would lead to a later one, so the earliest counts.
    """
    moves = np.flatnonzero(np.abs(np.diff(x_mm)) > AT_REST_MM)
    rests_s = np.diff(times_s[moves], prepend=times_s[0])
    begins = moves[rests_s > REST_LOOKED_AT_S] if moves.size else moves
    starts = []
    for begin in begins:
        origin = x_mm[begin]
        early = slice(begin + 1, begin + 8)
        travelled = np.abs(x_mm[early] - origin)
        starts.append(float(np.min(times_s[early] - travelled / STEP_SPEED_MM_S)))
    return np.array(starts)


def stroke_latencies_s(seen: Watched, *, floor_g2: float) -> list[float | None]:
    """Of each half second of strokes of any hand: from its readings to the vibration.

    Raises
    ------
    InputError
        If the hand did not stroke.
    """
    latencies: list[float | None] = []
    for record in seen.records:
        power, start_s = _power(record)
        bins = start_s + LAG_BIN_S * (np.arange(power.size) + 0.5)
        times_s, speeds = seen.readings["time_s"], np.abs(seen.readings["speed_mm_s"])
        speeds = np.where(seen.readings["force_n"] > 0, speeds, 0.0)
        level = np.interp(bins, times_s, np.minimum(speeds, LOWEST_SPEED_MM_S))
        past, length = round(LONGEST_LAG_S / LAG_BIN_S), round(TRIAL_STROKE_S / LAG_BIN_S)
        for at in range(past, power.size - length, length):
            part = slice(at - past, at + length)
            if level[part].max() > LEAST_SPEED_MM_S > 0.5 * level[part].min():
                lag = stroke_lag_s(
                    power[part], level[part], longest_s=LONGEST_LAG_S, floor_g2=floor_g2
                )
                latencies.append(lag)
    if not latencies:
        raise InputError(
            "expected a hand that strokes back and forth, got none; press, and stroke "
            "about 10 cm, once a second."
        )
    return latencies


def _power(record: Record) -> tuple[Floats, float]:
    """Mean square in bins of 1 ms, and when the first begins."""
    samples = high_passed(record.samples_g, rate_hz=record.rate_hz)
    edges = np.rint(np.arange(0, samples.size / record.rate_hz, LAG_BIN_S) * record.rate_hz)
    starts = edges.astype(int)[:-1]
    counts = np.diff(edges)
    return np.add.reduceat(samples**2, starts)[: counts.size] / counts, record.time_s


def loop_back_s(
    sound: PlaysSignals, accelerometer: Accelerometer, *, rate_hz: float, rms_g: float
) -> float:
    """From when a prepared signal leaves, as the driver states it, to when it is recorded.

    Raises
    ------
    InputError
        If no record holds it.
    """
    signal = noise_signal(0.3, rate_hz=rate_hz, rms_g=rms_g, band_hz=(20.0, 2500.0))
    delays: list[float] = []
    for _ in range(LOOP_BACKS):
        accelerometer.forget()
        presented = sound.play_signal(signal, wait=True)
        time.sleep(0.2)
        for record in accelerometer.stretches():
            try:
                pair = aligned(
                    signal, record.samples_g, played_rate_hz=rate_hz, rate_hz=record.rate_hz
                )
            except InputError as error:  # a stretch without all of it
                refusal = error
                continue
            delays.append(record.time_s + pair.delay_s - presented.time_s)
    if not delays:
        raise refusal
    return checked_loop_back_s(float(np.median(delays)))


def checked_loop_back_s(delay_s: float) -> float:
    """A delay of the loop-back; InputError where the record would be before the sound."""
    if delay_s < -EARLIEST_S:
        raise InputError(
            f"expected the record after the sound, got it {-1e3 * delay_s:.1f} ms before; samples "
            "were lost or a driver misstates its delay, so close other programs, and try again."
        )
    return delay_s
