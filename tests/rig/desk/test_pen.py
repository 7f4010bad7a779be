"""What an accelerometer at the pen measured during presentations, beside what was played."""

from __future__ import annotations

from collections.abc import Callable
from contextlib import AbstractContextManager
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from tactileq.rig.desk.desk_rig import DeskRig
from tactileq.rig.desk.pen_process import PenLog
from tactileq.rig.devices.simulated.card import DEVICE, SimulatedCard
from tactileq.rig.devices.simulated.vibrator import SimulatedTransducers
from tactileq.rig.recording.capture.input import InputBlock
from tactileq.rig.shared.live.clock import sleep
from tactileq.stimuli.planted.textures import planted_texture
from tests.rig.desk.rig_files import rig_file
from tests.rig.waiting import follow

Jack = Callable[..., AbstractContextManager[Any]]
ACCELEROMETER = f"""[accelerometer]
device = "{DEVICE}"
rate_hz = 48000
g_per_fullscale = {{ value = 50.0, unit = "g", assumed = false, source = "as simulated" }}
[real_surface]"""


def test_the_pen_feels_what_was_presented(jack_server: Jack, tmp_path: Path) -> None:
    vibrator = SimulatedTransducers(
        height=1.001, g_per_fullscale=20.0, sensor_fullscale_g=50.0, noise_g=1e-4
    )
    model = planted_texture("PVC")
    with jack_server(block=1024), SimulatedCard(vibrator):  # in time, though in Python
        changes = (
            ('"system"', f'"{DEVICE}"'),
            ("[real_surface]", ACCELEROMETER),
            ('kind = "scripted"', 'kind = "scripted"\nscript = "hold"'),
        )
        with DeskRig(rig_file(tmp_path, *changes)) as rig:
            assert rig.take_acceleration() == ()
            rig.present_model(model)
            follow(1.0, rig.read, every_s=0.1)
            rig.silence()
            pieces = rig.take_acceleration()
            (record,) = rig.take_presentations()
            sleep(0.3)  # nothing is kept while nothing is presented
            assert sum(piece.samples_g.size for piece in rig.take_acceleration()) < 4800
            assert not any("accelerometer" in fault.sentence for fault in rig.take_faults())
    assert pieces
    # A loaded machine loses blocks of the input; what is kept is of the presentation alone.
    measured_s = sum(piece.samples_g.size / piece.rate_hz for piece in pieces)
    assert 0.1 < measured_s < record.played_s + 0.5
    for piece in pieces:
        assert record.start_s - 0.5 < piece.start_s < record.end_s
    # A steady hand, and the power of most moments: a loaded machine loses some. While the simulated
    # card stands still the server gives zeros, which no accelerometer with noise gives.
    samples = np.concatenate([piece.samples_g for piece in pieces])
    samples = samples[samples != 0]
    assert samples.size > 4800
    moments = samples[: samples.size // 2400 * 2400].reshape(-1, 2400)
    power = float(np.median((moments**2).mean(axis=1)))
    assert power == pytest.approx(record.dose_g2_s / record.played_s, rel=0.3)


class Blocks:
    """An input that has blocks to give, each once."""

    rate_hz = 1000.0

    def __init__(self, *blocks: InputBlock) -> None:
        self._blocks = list(blocks)

    def give(self, *blocks: InputBlock) -> None:
        self._blocks += blocks

    def read(self) -> list[InputBlock]:
        taken, self._blocks = self._blocks, []
        return taken


def block(position: int, *, lost: bool = False) -> InputBlock:
    samples = np.arange(position, position + 10) / 100
    return InputBlock(position, samples, 5.0 + position / 1000, lost)


def test_pieces_begin_with_what_was_asked_for_and_end_where_samples_are_missing() -> None:
    source = Blocks(block(0), block(10))
    log = PenLog(source)  # type: ignore[arg-type]
    log.begin(5.015)
    source.give(block(20), block(30, lost=True))
    log.end()
    source.give(block(40))
    first, second = log.take()
    assert [one.position for one in first] == [10, 20]  # 5.010 s to 5.030 s
    assert [one.position for one in second] == [30]
    assert log.take() == []
    log.begin(5.045)  # what came since is recent still
    assert [[one.position for one in piece] for piece in log.take()] == [[40]]


def test_what_nobody_asks_for_is_forgotten() -> None:
    source = Blocks(*(block(10 * number) for number in range(500)))
    log = PenLog(source)  # type: ignore[arg-type]
    log.begin(0.0)
    (piece,) = log.take()
    assert sum(one.samples.size for one in piece) == 2000  # the last two of five seconds


def test_a_lost_process_is_told_once_and_the_session_goes_on(
    jack_server: Jack, tmp_path: Path
) -> None:
    with jack_server(block=128), SimulatedCard():
        changes = (('"system"', f'"{DEVICE}"'), ("[real_surface]", ACCELEROMETER))
        with DeskRig(rig_file(tmp_path, *changes)) as rig:
            rig.present_real("PVC")
            assert rig.parts.pen is not None
            assert rig.parts.pen._child is not None
            rig.parts.pen._child.kill()
            rig.silence()
            assert rig.take_acceleration() == ()
            (fault,) = [fault for fault in rig.take_faults() if not fault.invalidates]
            assert "accelerometer" in fault.sentence
            rig.present_real("PVC")
            rig.silence()
            assert not any("accelerometer" in again.sentence for again in rig.take_faults())
