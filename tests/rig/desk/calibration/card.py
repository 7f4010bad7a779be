"""A sound card that is calculated: what is played is recorded, at once."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from numpy.typing import ArrayLike

from tactileq.modeling.arrays import Floats
from tactileq.modeling.vibrators.compensation import compensation_for
from tactileq.rig.devices.simulated.vibrator import SimulatedAccelerometer, SimulatedTransducers
from tactileq.rig.devices.sound.output import Presented
from tactileq.rig.recording.capture.input import AudioInput, InputBlock, InputSettings
from tactileq.rig.shared.setup.rig_file import RigFile

RATE_HZ = 8000.0
RIG = """version = 1
[rig]
name = "calculated {folder}"
serials = ["A1"]
[sound]
rate_hz = {rate_hz:g}
fullscale_v = {{ value = 2.0, unit = "V", assumed = true, source = "a guess" }}
simulated = true
{sound}
[vibrator]
g_per_volt = {{ value = 4.0, unit = "g/V", assumed = true, source = "a guess" }}
[hand]
kind = "scripted"
[accelerometer]
rate_hz = {rate_hz:g}
g_per_fullscale = {{ value = 10.0, unit = "g", assumed = true, source = "planted" }}
{accelerometer}
[real_surface]
hand_measured = false
"""


def rig_file(
    folder: Path, *, rate_hz: float = RATE_HZ, sound: str = "", accelerometer: str = ""
) -> RigFile:
    """A rig whose calibration is a guess: 8 g per full scale; nobody else's lock is on its name."""
    path = folder / "rig.toml"
    path.write_text(
        RIG.format(folder=folder, rate_hz=rate_hz, sound=sound, accelerometer=accelerometer)
    )
    return RigFile.load(path)


class CalculatedCard(AudioInput):
    """Output and input; a sleeping program records nothing, playing takes no time."""

    running = True  # type: ignore[assignment]

    def __init__(
        self, rig: RigFile, vibrator: SimulatedTransducers, *, lost_first: int = 0
    ) -> None:
        super().__init__(InputSettings(10.0))
        self.rate_hz = RATE_HZ
        self._rig = rig
        self._accelerometer = SimulatedAccelerometer(vibrator, rate_hz=RATE_HZ)
        self._blocks: list[InputBlock] = []
        self._position = 0
        self._slip_s = 0.0
        self._lost_first = lost_first
        self.played: list[Floats] = []

    def play_signal(
        self, samples_g: ArrayLike, *, compensated: bool = False, wait: bool = False
    ) -> Presented:
        signal = np.asarray(samples_g, dtype=np.float64)
        self.played.append(signal)
        if self._rig.identified is not None and not compensated:
            signal = compensation_for(self._rig.identified, rate_hz=RATE_HZ).apply(signal)
        self.rest(0.2)
        if self._lost_first:
            self._lost_first -= 1
            self._slip_s += 0.05
        self._record(signal * self._rig.fullscale_per_g)
        self.rest(0.2)
        return Presented(presentation=len(self.played), time_s=0.0)

    def rest(self, seconds: float) -> None:
        """Record that nothing plays."""
        self._record(np.zeros(round(seconds * RATE_HZ)))

    def read(self) -> list[InputBlock]:
        blocks, self._blocks = self._blocks, []
        return blocks

    def _record(self, drive: Floats) -> None:
        heard = self._accelerometer.give(drive)
        for part in np.split(heard, range(160, heard.size, 160)):
            time_s = 100.0 + self._position / RATE_HZ + self._slip_s
            self._blocks.append(InputBlock(self._position, part, time_s, lost=False))
            self._position += part.size
