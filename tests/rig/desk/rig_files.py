"""Rig files for tests: a scripted hand, and JACK's server without a card."""

from __future__ import annotations

from collections.abc import Iterable
from datetime import date
from pathlib import Path

from tactileq.rig.desk.calibration.level import MeasuredLevel
from tactileq.rig.desk.calibration.steps import level_figures
from tactileq.rig.shared.interface import Fault
from tactileq.rig.shared.setup.rig_file import RigFile

TEXT = """
version = 1
[rig]
name = "NAME"
serials = ["C1", "V1"]
[sound]
device = "system"
rate_hz = 48000
fullscale_v = { value = 1.0, unit = "V", assumed = false, source = "voltmeter" }
simulated = true
[vibrator]
g_per_volt = { value = 20.0, unit = "g/V", assumed = false, source = "accelerometer" }
[limits]
peak_g = { value = 5.0, unit = "g", assumed = true, source = "chosen" }
rms_g = { value = 2.0, unit = "g", assumed = true, source = "chosen" }
[hand]
kind = "scripted"
[latency]
median_ms = { value = 12.0, unit = "ms", assumed = false, source = "accelerometer" }
p95_ms = { value = 18.0, unit = "ms", assumed = false, source = "accelerometer" }
[calibration]
date = DATE
rig = "NAME"
serials = ["V1", "C1"]
[real_surface]
hand_measured = false
"""


def rig_text(path: Path) -> str:
    """A calibrated rig, of a name of its own so that tests side by side do not lock each other."""
    return TEXT.replace("NAME", str(path)).replace("DATE", date.today().isoformat())


def rig_file(folder: Path, *changes: tuple[str, str]) -> RigFile:
    """The rig file with these changes."""
    path = folder / "rig.toml"
    text = rig_text(path)
    for old, new in changes:
        assert old in text
        text = text.replace(old, new, 1)
    path.write_text(text, encoding="utf-8")
    return RigFile.load(path)


def calibrated(rig: RigFile) -> RigFile:
    """The rig after the level was calibrated as it is: it says what that rests on."""
    level = MeasuredLevel(gain=1.0, low=1.0, high=1.0, spread_db=0.0, placements=3)
    figures = level_figures(rig, level, band_hz=(100.0, 500.0), today=date.today())
    return RigFile.updated(rig.path, figures)


def failures(faults: Iterable[Fault]) -> list[str]:
    """What failed, but for readings that a loaded machine was too slow to take."""
    told = [fault.sentence for fault in faults if fault.invalidates]
    return [sentence for sentence in told if "reading of the hand within" not in sentence]
