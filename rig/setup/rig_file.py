"""The rig file: everything that is known or assumed about one rig (docs/rig-file.md).

A TOML file; its paths are relative to it, and what is not understood is refused. Every physical
quantity says its unit, and whether it is assumed or was measured. `desk_rig.toml`, beside this
module, is the one that ships.
"""

from __future__ import annotations

import hashlib
import tomllib
from collections.abc import Mapping
from dataclasses import dataclass, fields
from functools import cached_property
from pathlib import Path
from typing import Any

from modeling import InputError
from modeling.checks import check_keys
from modeling.files.documents import check_version, read_toml, toml_section
from modeling.files.hashes import sha256_of_values
from modeling.files.reading import read_bytes, read_text
from modeling.files.writing import write_text
from modeling.rendering.limits import Limits
from modeling.vibrators.vibrator import Vibrator
from rig.setup.editing import with_value
from rig.setup.figures import Curve, Figure
from rig.setup.sections import (
    AccelerometerSection,
    CalibrationSection,
    HandSection,
    LatencySection,
    LimitsSection,
    RealSurfaceSection,
    RigName,
    SoundSection,
    VibratorSection,
    figures_of,
    plain_section,
    section_from,
)

VERSION = 1
SHIPPED_RIG_FILE = Path(__file__).with_name("desk_rig.toml")
_SECTIONS: dict[str, type[Any]] = {
    "rig": RigName,
    "sound": SoundSection,
    "vibrator": VibratorSection,
    "limits": LimitsSection,
    "hand": HandSection,
    "accelerometer": AccelerometerSection,
    "latency": LatencySection,
    "calibration": CalibrationSection,
    "real_surface": RealSurfaceSection,
}
_NOT_NEEDED = ("accelerometer", "latency", "calibration")


@dataclass(frozen=True, kw_only=True)
class RigFile:
    """One rig, as its file describes it; made by `RigFile.load`.

    Parameters
    ----------
    path : Path
        The file.
    rig, sound, vibrator, limits, hand, accelerometer, latency, calibration, real_surface
        Its sections (`rig.setup.sections`). None where there is no accelerometer, and where
        latency or calibration have not been measured yet.
    identified : Vibrator, optional
        What the file that [vibrator] names holds.
    """

    path: Path
    rig: RigName
    sound: SoundSection
    vibrator: VibratorSection
    limits: LimitsSection
    hand: HandSection
    accelerometer: AccelerometerSection | None
    latency: LatencySection | None
    calibration: CalibrationSection | None
    real_surface: RealSurfaceSection
    identified: Vibrator | None

    @staticmethod
    def load(path: str | Path) -> RigFile:
        """Read a rig file (TOML).

        Raises
        ------
        InputError
            If the file is missing, no TOML or of another version, has unknown or missing keys,
            other units, or values out of range; likewise of the vibrator that it names.
        """
        file = Path(path)
        values = read_toml(file, "a rig file")
        return _rig_from(values, file)

    @staticmethod
    def updated(path: str | Path, values: Mapping[str, object]) -> RigFile:
        """Change a rig file and read it again; comments are kept, and the file is never left half
        written.

        Parameters
        ----------
        path : path
        values : mapping
            From "section.key" to a Figure, a Curve, text, number, bool, date or list of texts.

        Raises
        ------
        InputError
            If the file cannot be read, or would not be a rig file any more; then nothing
            has changed.
        """
        file = Path(path)
        RigFile.load(file)
        text = read_text(file, "a rig file")
        for name, value in values.items():
            section, _, key = name.partition(".")
            text = with_value(text, section, key, value=value)
        _rig_from(tomllib.loads(text), file)
        write_text(file, text)
        return RigFile.load(file)

    @cached_property
    def vibrator_sha256(self) -> str | None:
        """SHA-256 of the file that [vibrator] names, None where it names none."""
        file = self.vibrator.file
        if file is None:
            return None
        return hashlib.sha256(read_bytes(self.path.parent / file, "the vibrator")).hexdigest()

    def to_dict(self) -> dict[str, Any]:
        """Plain values that JSON takes too, defaults written out."""
        sections = {name: getattr(self, name) for name in _SECTIONS}
        given = {name: plain_section(part) for name, part in sections.items() if part is not None}
        identified = {} if self.identified is None else {"file_sha256": self.identified.sha256}
        return {"version": VERSION, **given, "vibrator": given["vibrator"] | identified}

    @cached_property
    def sha256(self) -> str:
        """SHA-256 of its values and of the vibrator that it names."""
        return sha256_of_values(self.to_dict())

    def figures(self) -> dict[str, Figure | Curve]:
        """Every quantity by its name "section.key", in the order of the file."""
        return {
            f"{name}.{key}": figure
            for name in _SECTIONS
            if getattr(self, name) is not None
            for key, figure in figures_of(getattr(self, name)).items()
        }

    def assumed(self) -> list[tuple[str, Figure | Curve]]:
        """The quantities that were not measured at this rig."""
        return [(name, figure) for name, figure in self.figures().items() if figure.assumed]

    @property
    def files(self) -> tuple[Path, ...]:
        """The other files that it names."""
        named = self.vibrator.file
        return () if named is None else (self.path.parent / named,)

    @property
    def fullscale_per_g(self) -> float:
        """What the card has to put out, as a share of full scale, for 1 g at the held pen."""
        return 1 / (self.sound.fullscale_v.value * self.vibrator.g_per_volt.value)

    @property
    def safe_limits(self) -> Limits:
        """[limits] as a renderer takes them."""
        return Limits(
            peak=self.limits.peak_g.value,
            rms=self.limits.rms_g.value,
            rms_window_s=self.limits.rms_window_s.value,
            duration_s=self.limits.duration_s.value,
            pause_s=self.limits.pause_s.value,
        )

    @property
    def simulated(self) -> bool:
        """Whether no person feels anything here: a scripted hand, or a card that is none."""
        return self.hand.kind == "scripted" or self.sound.simulated


def _rig_from(values: Mapping[str, Any], file: Path) -> RigFile:
    """A rig from the plain values of its file, which every refusal names."""
    try:
        return _checked_rig(values, file)
    except InputError as error:
        raise InputError(f"{file}: {error}") from None


def _checked_rig(values: Mapping[str, Any], file: Path) -> RigFile:
    check_keys(values, ("version", *_SECTIONS), where="a rig file")
    check_version(values, VERSION, what="rig file")
    sections = {name: _section(values, name, kind) for name, kind in _SECTIONS.items()}
    named = sections["vibrator"].file
    identified = None if named is None else Vibrator.load(file.parent / named)
    return RigFile(path=file, identified=identified, **sections)


def _section(values: Mapping[str, Any], name: str, kind: type[Any]) -> Any:
    known = tuple(key.name for key in fields(kind))
    table = toml_section(values, name, known)
    if name in _NOT_NEEDED and name not in values:
        return None
    return section_from(kind, table, name)
