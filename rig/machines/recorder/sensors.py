"""What measures while the recorder holds speed and force (docs/recorder.md#sensor)."""

from __future__ import annotations

import time
from collections.abc import Callable
from contextlib import suppress
from os import SEEK_END
from pathlib import Path
from stat import S_ISREG
from typing import NamedTuple, Protocol

import numpy as np

from tactileq.modeling.arrays import Floats
from tactileq.modeling.errors import InputError
from tactileq.modeling.files.places import matching
from tactileq.modeling.models.grid import Condition
from tactileq.rig.machines.recorder.evaluation import Axis, check_alive, read_evaluation
from tactileq.rig.recording.capture.input import AudioInput, InputBlock

SETTLED_S = 0.5  # a file that has not changed for so long may be whole
MARGIN_S = 5.0  # that the recorder holds longer than a sound card should need
FULL_SCALE = 0.9999
CLOCK_S, CLOCK_SHARE = 0.1, 2e-3  # by which the sensor's clock may differ from the recorder's


class SensorRefused(InputError):
    """A record that the sensor did not measure as it should; another attempt may succeed."""


class Sensor(Protocol):
    """What a run needs of it: `begin` once the recorder records, then `enough` until it is."""

    rate_hz: float

    def hold_s(self, duration_s: float) -> float:
        """How long the recorder is to hold speed and force at most, for so long a record."""

    def begin(self, duration_s: float) -> None:
        """Speed and force are held from now on."""

    def enough(self) -> bool:
        """Whether they need not be held any longer."""

    def samples(self, condition: Condition) -> Floats:
        """(n,) in g, n = duration times rate."""

    def clock_s(self) -> float | None:
        """How long it has been measuring, by its own clock; None where that says nothing."""


class DrawnVibration:
    """In place of an accelerometer on a simulated recorder: vibration drawn from spectra.

    Parameters
    ----------
    rate_hz : float
    emerged : callable
        Gives the mechanics' true mean speed (mm/s) and force (N) of the last record.
    draw : callable
        Gives (n,) g for a speed, a force, a duration (s) and the condition that was asked for.
    """

    def __init__(
        self,
        rate_hz: float,
        emerged: Callable[[], tuple[float, float]],
        draw: Callable[[float, float, float, Condition], Floats],
    ) -> None:
        self.rate_hz = rate_hz
        self._emerged, self._draw = emerged, draw
        self._duration_s = 0.0

    def hold_s(self, duration_s: float) -> float:
        """See `Sensor`."""
        return duration_s

    def begin(self, duration_s: float) -> None:
        """See `Sensor`."""
        self._duration_s = duration_s

    def enough(self) -> bool:
        """See `Sensor`; the recorder ends the record itself."""
        return False

    def samples(self, condition: Condition) -> Floats:
        """See `Sensor`."""
        return self._draw(*self._emerged(), self._duration_s, condition)

    def clock_s(self) -> float | None:
        """See `Sensor`."""
        return None


class _Seen(NamedTuple):
    """A file as it was at one look."""

    name: str
    changed_ns: int
    size: int


def _ends_whole(path: Path) -> bool:
    """Whether its last line has an end; one that cannot be read may in a moment."""
    try:
        with path.open("rb") as file:
            file.seek(-1, SEEK_END)
            return file.read() == b"\n"
    except OSError:
        return False


class EvaluationFiles:
    """Files that the evaluation tool of the accelerometer saves into a folder, one for each record.

    Parameters
    ----------
    folder : Path
    rate_hz : float
    axis : {"x", "y", "z"}
    wait_s : float
        Longest time that speed and force are held for a file.
    tell : callable
        Is told when a file is to be saved, and what is to be known of how they are read.

    Raises
    ------
    InputError
        Without the folder.
    """

    def __init__(
        self,
        folder: Path,
        *,
        rate_hz: float,
        axis: Axis,
        wait_s: float,
        tell: Callable[[str], None] = lambda sentence: None,
    ) -> None:
        if not folder.is_dir():
            raise InputError(
                f"expected a folder at {folder} for the evaluation tool's files, got none; make "
                "it, or correct sensor.files."
            )
        self.rate_hz = rate_hz
        self._folder, self._axis, self._wait_s, self._tell = folder, axis, wait_s, tell
        self._before: set[_Seen] = set()
        self._noted: set[str] = set()
        self._duration_s = self._began_s = self._came_s = 0.0
        self._growing: tuple[_Seen, ...] = ()

    def hold_s(self, duration_s: float) -> float:
        """See `Sensor`."""
        return max(self._wait_s, duration_s) + SETTLED_S

    def begin(self, duration_s: float) -> None:
        """See `Sensor`."""
        self._duration_s, self._growing = duration_s, ()
        self._before = set(self._seen())
        self._began_s = self._came_s = time.monotonic()
        self._tell(f"speed and force are held: save a file into {self._folder} now")

    def enough(self) -> bool:
        """See `Sensor`: once a new file ends with a whole line and has not changed for 0.5 s."""
        now_s = time.monotonic()
        new = tuple(one for one in self._seen() if one not in self._before)
        if new != self._growing:
            self._growing, self._came_s = new, now_s
        settled = new and now_s - self._came_s >= SETTLED_S
        return bool(settled) and all(_ends_whole(self._folder / one.name) for one in new)

    def samples(self, condition: Condition) -> Floats:
        """See `Sensor`."""
        new = [one.name for one in self._seen() if one not in self._before]
        if not new:
            raise InputError(
                f"expected a CSV file in {self._folder} within {self._wait_s:g} s, got none; save "
                "one with the evaluation tool while speed and force are held."
            )
        if len(new) > 1:
            raise SensorRefused(
                f"expected one file for each record in {self._folder}, got "
                f"{' and '.join(new[:3])}; save one only."
            )
        try:
            return self._read(self._folder / new[0])
        except SensorRefused:
            raise
        except InputError as refused:
            raise SensorRefused(str(refused)) from None

    def _read(self, file: Path) -> Floats:
        notes: list[str] = []
        samples = read_evaluation(file, rate_hz=self.rate_hz, axis=self._axis, tell=notes.append)
        wanted = round(self._duration_s * self.rate_hz)
        if samples.size < wanted:
            raise SensorRefused(
                f"expected {wanted} samples in {file.name}, got {samples.size}; have the "
                f"evaluation tool record for {self._duration_s:g} s, or if it did, samples were "
                "lost: record again."
            )
        lasted_s, held_s = samples.size / self.rate_hz, self._came_s - self._began_s
        if lasted_s > held_s + CLOCK_S:
            raise SensorRefused(
                f"expected {file.name} to lie within the {held_s:.2f} s in which speed and force "
                f"were held, got {lasted_s:.2f} s; it began too early, or the clocks of sensor and "
                "wire disagree: correct sensor.rate_hz."
            )
        for note in notes:
            if note not in self._noted:  # once for all files
                self._noted.add(note)
                self._tell(f"{file.name}: {note}")
        return samples[:wanted]

    def _seen(self) -> list[_Seen]:
        """Its CSV files; one that is overwritten is another one."""
        found = []
        for path in matching(self._folder, "*"):
            if path.suffix.lower() == ".csv":
                with suppress(OSError):  # renamed or removed just now
                    state = path.stat()
                    if S_ISREG(state.st_mode):
                        found.append(_Seen(path.name, state.st_mtime_ns, state.st_size))
        return found

    def clock_s(self) -> float | None:
        """See `Sensor`; each file has its own clock, which `samples` compares."""
        return None


class SoundCardSensor:
    """An accelerometer at a sound card.

    Parameters
    ----------
    source : AudioInput
        Open.
    """

    def __init__(self, source: AudioInput) -> None:
        self.rate_hz = source.rate_hz
        self._source = source
        self._wanted = 0
        self._blocks: list[InputBlock] = []
        self._heard = 0

    def hold_s(self, duration_s: float) -> float:
        """See `Sensor`."""
        return duration_s + MARGIN_S

    def begin(self, duration_s: float) -> None:
        """See `Sensor`."""
        self._hear()
        self._wanted, self._blocks = round(duration_s * self.rate_hz), []

    def enough(self) -> bool:
        """See `Sensor`."""
        self._blocks += self._hear()
        # The first block may have begun before.
        return sum(block.samples.size for block in self._blocks[1:]) >= self._wanted

    def samples(self, condition: Condition) -> Floats:
        """See `Sensor`."""
        blocks = self._blocks[1:]
        heard = np.concatenate([block.samples for block in blocks]) if blocks else np.zeros(0)
        if heard.size < self._wanted or any(block.lost for block in blocks):
            raise InputError(
                f"expected {self._wanted} samples of the sound card without a gap, got "
                f"{heard.size}{' with one' if heard.size >= self._wanted else ''}; check the card "
                "and the load of the computer, then record again."
            )
        heard = heard[: self._wanted]
        if (clipped := int(np.count_nonzero(np.abs(heard) >= FULL_SCALE))) > 0:
            raise InputError(
                f"expected samples below the sound card's full scale, got {clipped} at it; lower "
                "its input gain, calibrate it again, then record again."
            )
        check_alive(heard, rate_hz=self.rate_hz, where="what the sound card heard")
        return heard * self._source.settings.g_per_fullscale

    def clock_s(self) -> float | None:
        """See `Sensor`."""
        self._blocks += self._hear()
        return self._heard / self.rate_hz

    def _hear(self) -> list[InputBlock]:
        if not self._source.running:
            raise InputError(
                "expected the sound card to go on, got its end; check its cable, then run the "
                "command again to continue."
            )
        blocks = self._source.read()
        self._heard += sum(block.samples.size for block in blocks)
        return blocks
