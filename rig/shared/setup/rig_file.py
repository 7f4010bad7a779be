"""The rig file: everything that is known or assumed about one rig (docs/rig-file.md).

A TOML file; its paths are relative to it, and what is not understood is refused. Every physical
quantity says its unit, and whether it is assumed or was measured. `desk_rig.toml`, beside this
module, is the one that ships.
"""

from __future__ import annotations

import datetime
import hashlib
import tomllib
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from math import isclose
from pathlib import Path
from typing import Annotated, Any, ClassVar, Self

from tactileq.modeling.errors import InputError, shown
from tactileq.modeling.files.described import BESIDE, DescribedFile, keys_of, naming
from tactileq.modeling.files.documents import read_toml
from tactileq.modeling.files.hashes import sha256_of_values
from tactileq.modeling.files.reading import read_bytes, read_text
from tactileq.modeling.files.writing import write_text
from tactileq.modeling.rendering.limits import Limits
from tactileq.modeling.vibrators.exposure import ACTION_VALUE_M_S2
from tactileq.modeling.vibrators.vibrator import Vibrator
from tactileq.rig.shared.setup.editing import with_values
from tactileq.rig.shared.setup.figures import Curve, Figure
from tactileq.rig.shared.setup.force_sections import DeviceSection, ForceSection, PoseSection
from tactileq.rig.shared.setup.sections import (
    AccelerometerSection,
    CalibrationSection,
    HandSection,
    LatencySection,
    LimitsSection,
    RealSurfaceSection,
    RigName,
    SoundSection,
    VibratorSection,
)

DEVICE_RATE_HZ = 5000.0  # of the control loop of [device]
DEVICE_BLOCK_S = 0.01  # between looks at what it has played
SHORT_SHA256 = 12  # digits that tell two vibrators apart
SHIPPED_RIG_FILE = Path(__file__).with_name("desk_rig.toml")


@dataclass(frozen=True, kw_only=True)
class RigFile(DescribedFile):
    """One rig, as its file describes it.

    Parameters
    ----------
    rig, sound, vibrator, limits, hand, force, device, pose, accelerometer, latency, calibration
        Its sections (`tactileq.rig.shared.setup.sections`,
        `tactileq.rig.shared.setup.force_sections`). None where there is no force device or
        accelerometer, and where pose, latency or calibration have not been measured yet.
    real_surface : RealSurfaceSection
    path : Path
        The file.
    identified : Vibrator, optional
        What the file that [vibrator] names holds.
    """

    WHAT: ClassVar[str] = "a rig file"
    VERSION: ClassVar[int] = 1
    rig: RigName
    sound: SoundSection
    vibrator: VibratorSection
    limits: LimitsSection = field(default=LimitsSection())
    hand: HandSection
    force: ForceSection | None = None
    device: DeviceSection | None = None
    pose: PoseSection | None = None
    accelerometer: AccelerometerSection | None = None
    latency: LatencySection | None = None
    calibration: CalibrationSection | None = None
    real_surface: RealSurfaceSection
    path: Annotated[Path, BESIDE] = Path()
    identified: Annotated[Vibrator | None, BESIDE] = None

    def __post_init__(self) -> None:
        super().__post_init__()
        if self.hand.kind == "force" and self.force is None:
            raise InputError(
                'expected [force] for hand.kind = "force", got none; describe the device there, or '
                "take another hand."
            )
        self._check_device()
        homed = None if self.force is None else self.force.homed_on
        if self.pose is not None and homed is not None and self.pose.measured_on < homed:
            raise InputError(
                f"expected a pose that was measured since the force device was homed on {homed}, "
                f"got one of {self.pose.measured_on}; measure it again (tactileq rig pose)."
            )

    def _check_device(self) -> None:
        force = self.force_device
        if self.own_device is None or force is None:
            return
        given = [
            name
            for name, value in (("force.library", force.library), ("[pose]", self.pose))
            if value is not None
        ]
        if given:
            raise InputError(
                f"expected neither force.library nor [pose] beside [device], got {given[0]}; the "
                "device has its own geometry (docs/device.md): remove one of them."
            )
        if force.rate_hz != DEVICE_RATE_HZ:
            raise InputError(
                f"expected force.rate_hz = {DEVICE_RATE_HZ:g} beside [device], got "
                f"{force.rate_hz:g}; its control loop has no other rate."
            )
        delay_ms = 1e3 * self.hand.filter_delay_s.value
        if not (0.5 <= delay_ms < 32.5 and isclose(delay_ms, round(delay_ms))):
            raise InputError(
                f"expected hand.filter_delay_s of 1 to 32 whole ms beside [device], got "
                f"{delay_ms:g} ms; its filter has no other delay."
            )

    @classmethod
    def load(cls, path: str | Path) -> Self:
        """Read a rig file (TOML).

        Raises
        ------
        InputError
            If the file is missing, no TOML or of another version, has unknown or missing keys,
            other units, or values out of range; likewise of the vibrator that it names.
        """
        file = Path(path)
        return cls._from(read_toml(file, cls.WHAT), file)

    @classmethod
    def _from(cls, values: Mapping[str, Any], file: Path) -> Self:
        with naming(file):
            rig = cls.from_tables(values)
            named = [Vibrator.load(vibrator) for vibrator in replace(rig, path=file).files]
        return replace(rig, path=file, identified=next(iter(named), None))

    @classmethod
    def updated(cls, path: str | Path, values: Mapping[str, object]) -> Self:
        """Change a rig file and read it again; comments are kept, and the file is never left half
        written.

        Parameters
        ----------
        values : mapping
            From "section.key" to a Figure, a Curve, text, number, bool, date or list of texts.

        Raises
        ------
        InputError
            If the file cannot be read, or would not be a rig file any more; then nothing
            has changed.
        """
        file = Path(path)
        cls.load(file)
        text = with_values(read_text(file, cls.WHAT), values)
        rig = cls._from(tomllib.loads(text), file)
        write_text(file, text)
        return rig

    @cached_property
    def vibrator_sha256(self) -> str | None:
        """SHA-256 of the file that [vibrator] names, None where it names none."""
        file = self.vibrator.file
        if file is None:
            return None
        return hashlib.sha256(read_bytes(self.path.parent / file, "the vibrator")).hexdigest()

    def to_dict(self) -> dict[str, Any]:
        """Plain values that JSON takes too, defaults written out."""
        given: dict[str, Any] = _given(super().to_dict())
        if self.identified is not None:
            given["vibrator"]["file_sha256"] = self.identified.sha256
        return {"version": self.VERSION, **given}

    @cached_property
    def sha256(self) -> str:
        """SHA-256 of its values and of the vibrator that it names."""
        return sha256_of_values(self.to_dict())

    def figures(self) -> dict[str, Figure | Curve]:
        """Every quantity by its name "section.key", in the order of the file."""
        sections = [(one.name, getattr(self, one.field)) for one in keys_of(RigFile)]
        return {
            f"{name}.{key}": value
            for name, section in sections
            if section is not None
            for key, value in vars(section).items()
            if isinstance(value, Figure | Curve)
        }

    def assumed(self) -> list[tuple[str, Figure | Curve]]:
        """The quantities that were not measured at this rig."""
        return [(name, figure) for name, figure in self.figures().items() if figure.assumed]

    @property
    def files(self) -> tuple[Path, ...]:
        """The other files that it names."""
        script = self.hand.script if Path(self.hand.script).suffix else None
        named = (self.vibrator.file, script)
        return tuple(self.path.parent / name for name in named if name is not None)

    @property
    def fullscale_per_g(self) -> float:
        """What the converter has to put out for 1 g at the held pen.

        As a share of full scale; of a device that renders the texture in its own unit.
        """
        return 1 / (self.output_v.value * self.vibrator.g_per_volt.value)

    @property
    def level_basis(self) -> dict[str, str]:
        """What g at the held pen rests on: keys and their values, of a file its content.

        That is what plays, what it drives, and what the level is measured with.
        """
        device, sound, sensor = self.renderer, self.sound, self.accelerometer
        basis: dict[str, object] = {"device.renders": device is not None}
        if device is None:
            basis |= {
                "sound.device": sound.device,
                "sound.rate_hz": sound.rate_hz,
                "sound.vibration_channel": sound.vibration_channel,
                "sound.fullscale_v": sound.fullscale_v,
                "sound.simulated": sound.simulated,
            }
        else:
            basis |= {
                "device.address": device.address,
                "device.volts_per_g": device.volts_per_g,
                "device.simulated": device.simulated,
            }
        sha256 = None if self.identified is None else self.identified.sha256
        basis |= {
            "vibrator.file": sha256 and f"SHA-256 {sha256[:SHORT_SHA256]}",
            "vibrator.g_per_volt": self.vibrator.g_per_volt,
        }
        if sensor is not None:
            basis |= {
                "accelerometer.device": sensor.device,
                "accelerometer.channel": sensor.channel,
                "accelerometer.g_per_fullscale": sensor.g_per_fullscale,
            }
        return {name: _in_words(value) for name, value in basis.items()}

    @property
    def latency_basis(self) -> dict[str, str]:
        """What the time from the hand to the vibration rests on: keys and their values."""
        sound, hand = self.sound, self.hand
        basis: dict[str, object] = {
            "sound.device": sound.device,
            "sound.rate_hz": sound.rate_hz,
            "sound.block": sound.block,
            "hand.kind": hand.kind,
            "hand.device": hand.device,
            "hand.filter_delay_s": hand.filter_delay_s,
        }
        return {name: _in_words(value) for name, value in basis.items()}

    def check_latency(self) -> None:
        """Refuse a latency of another card, block or hand; none is no claim.

        Raises
        ------
        InputError
        """
        if self.latency is not None:
            self._check_basis(
                self.latency.rests_on or (),
                self.latency_basis,
                "latency was measured",
                "measure the latency again (tactileq rig latency)",
            )

    def _check_basis(
        self, lines: Sequence[str], now: Mapping[str, str], done: str, again: str
    ) -> None:
        then = dict(line.partition(" = ")[::2] for line in lines)
        changed = [name for name, was in then.items() if now.get(name) != was]
        if changed:
            raise InputError(
                f"expected {_listed(changed, then)} in {self.path}, as when the {done}, got "
                f"{_listed(changed, now)}; {again}, or undo the change."
            )

    def check_calibration(self) -> None:
        """Refuse a calibration that is not that of this rig as it is now; none is no claim.

        Raises
        ------
        InputError
            For another rig's name or serial numbers, and for another value of what the level rests
            on.
        """
        done = self.calibration
        if done is None:
            return
        if done.rig != self.rig.name or set(done.serials) != set(self.rig.serials):
            raise InputError(
                f"expected a calibration of {_named(self.rig.name, self.rig.serials)} in "
                f"{self.path}, got that of {_named(done.rig, done.serials)}; calibrate it "
                "(tactileq rig calibrate level)."
            )
        lines: Sequence[str] = done.rests_on or ()
        if self.accelerometer is None:  # it may go once the level is known
            lines = [line for line in lines if not line.startswith("accelerometer.")]
        self._check_basis(
            lines,
            self.level_basis,
            "level was calibrated",
            "calibrate the level again (tactileq rig calibrate level)",
        )

    @property
    def renderer(self) -> DeviceSection | None:
        """[device] where it renders the texture; None where the sound card does."""
        device = self.own_device
        return device if device is not None and device.renders else None

    @property
    def output_v(self) -> Figure:
        """Voltage at the vibrator where the converter puts out 1."""
        device = self.renderer
        if device is None or device.volts_per_g is None:
            return self.sound.fullscale_v
        return device.volts_per_g

    @property
    def output_rate_hz(self) -> float:
        """Of the samples that drive the vibrator."""
        return self.sound.rate_hz if self.renderer is None else DEVICE_RATE_HZ

    @property
    def output_block_s(self) -> float:
        """Between two rows of the log of what was played."""
        if self.renderer is not None:
            return DEVICE_BLOCK_S
        return self.sound.block / self.sound.rate_hz

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
    def force_device(self) -> ForceSection | None:
        """[force] where the hand is of that kind; None of any other rig."""
        return self.force if self.hand.kind == "force" else None

    @property
    def own_device(self) -> DeviceSection | None:
        """[device] where the hand is of kind "force"; None of any other rig."""
        return self.device if self.hand.kind == "force" else None

    @property
    def highest_exposure_m_s2(self) -> float:
        """Up to which daily exposure A(8) a participant may be stimulated."""
        given = self.limits.exposure_m_s2
        return ACTION_VALUE_M_S2 if given is None else given.value

    @property
    def simulated(self) -> bool:
        """Whether no person feels anything here: a scripted hand, or a card that is none."""
        device = self.force_device
        stands_in = device is not None and device.simulated
        stands_in |= self.own_device is not None and self.own_device.simulated
        return self.hand.kind == "scripted" or self.sound.simulated or stands_in


def _given(value: Any) -> Any:
    """Plain values for JSON, without what is not given."""
    if isinstance(value, dict):
        return {name: _given(one) for name, one in value.items() if one is not None}
    return value.isoformat() if isinstance(value, datetime.date) else value


def _in_words(value: object) -> str:
    """As a line of [calibration] says it; digits beyond the ninth are no other level."""
    if isinstance(value, Figure):
        return f"{value.value:.9g} {value.unit}"
    if isinstance(value, bool) or value is None:
        return {True: "true", False: "false", None: "none"}[value]
    return f"{value:.9g}" if isinstance(value, float) else str(value)


def _listed(names: Sequence[str], values: Mapping[str, str]) -> str:
    return ", ".join(f"{name} = {values.get(name, 'none')}" for name in names)


def _named(name: str, serials: Sequence[str]) -> str:
    return f"the rig {shown(name)}" + (f" ({', '.join(sorted(serials))})" if serials else "")
