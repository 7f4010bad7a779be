"""The sections of a rig file: the meaning of each key, its unit, its range and its default."""

from __future__ import annotations

import datetime
from collections.abc import Callable, Mapping
from dataclasses import MISSING, Field, dataclass, field, fields
from typing import Any, TypeVar

from modeling import InputError
from modeling.checks import (
    check_choice,
    check_name,
    check_number,
    check_rate,
    check_whole,
)
from modeling.errors import shown
from rig.setup.figures import Curve, Figure, curve_from, figure_from

LOUDEST_MASKING = 0.5
HAND_KINDS = ("tablet", "mouse", "serial", "window", "scripted")
_WITHOUT_FORCE = ("mouse", "window")
_LEAST = 1e-6  # far below any rig's, and far above what a division by it could not hold
_DEFAULT = "default of tactileq, measured nowhere"
Section = TypeVar("Section")
Reader = Callable[[object, str], Any]


def _read_by(reader: Reader) -> dict[str, Reader]:
    return {"reader": reader}


def _figure(unit: str, high: float, *, low: float = _LEAST) -> dict[str, Reader]:
    """A quantity in a unit, from `low` to `high`."""
    return _read_by(lambda value, what: figure_from(value, what, unit=unit, low=low, high=high))


def _assumed(value: float, unit: str) -> Figure:
    return Figure(value, unit, True, _DEFAULT)


def _whole(low: int, high: int) -> dict[str, Reader]:
    return _read_by(lambda value, what: _checked_whole(value, what, low, high))


def _text(value: object, what: str) -> str:
    check_name(what, value)
    return str(value)


def _checked_whole(value: object, what: str, low: int, high: int) -> int:
    check_whole(what, value, low=low, high=high)
    return int(value)  # type: ignore[call-overload, no-any-return]


def _rate(value: object, what: str) -> float:
    check_rate(value, what=what)
    return float(value)  # type: ignore[arg-type]


def _level(value: object, what: str) -> float:
    check_number(f"{what} (RMS, shares of full scale)", value, high=LOUDEST_MASKING)
    return float(value)  # type: ignore[arg-type]


def _kind(value: object, what: str) -> str:
    check_choice(what, value, HAND_KINDS)
    return str(value)


def _flag(value: object, what: str) -> bool:
    if not isinstance(value, bool):
        raise InputError(f"expected true or false for {what}, got {shown(value)}; correct it.")
    return value


def _date(value: object, what: str) -> datetime.date:
    if not isinstance(value, datetime.date) or isinstance(value, datetime.datetime):
        raise InputError(
            f"expected a date for {what}, got {shown(value)}; write it as 2026-11-22, without "
            "quotes."
        )
    return value


def _names(value: object, what: str) -> tuple[str, ...]:
    if not isinstance(value, list | tuple):
        raise InputError(
            f'expected a list of texts for {what}, got {shown(value)}; write ["…", "…"].'
        )
    for name in value:
        check_name(what, name)
    return tuple(value)


def _pressure(value: object, what: str) -> Curve:
    return curve_from(value, what, unit="N")


@dataclass(frozen=True, kw_only=True)
class RigName:
    """[rig]: which rig this is; `serials` are those of all that its calibration depends on."""

    name: str = field(metadata=_read_by(_text))
    serials: tuple[str, ...] = field(default=(), metadata=_read_by(_names))


@dataclass(frozen=True, kw_only=True)
class SoundSection:
    """[sound]: the card. Channels count from 1.

    `fullscale_v` is the voltage at the vibrator for a sample of full scale, amplifier included;
    `masking_level` the RMS of the masking noise in sessions, as a share of full scale.
    """

    device: str | None = field(default=None, metadata=_read_by(_text))
    rate_hz: float = field(metadata=_read_by(_rate))
    block: int = field(default=128, metadata=_whole(16, 4096))
    channels: int = field(default=2, metadata=_whole(1, 64))
    vibration_channel: int = field(default=1, metadata=_whole(1, 64))
    masking_channel: int | None = field(default=None, metadata=_whole(1, 64))
    masking_level: float = field(default=0.0, metadata=_read_by(_level))
    fullscale_v: Figure = field(metadata=_figure("V", 1000.0))
    simulated: bool = field(default=False, metadata=_read_by(_flag))

    def __post_init__(self) -> None:
        if self.masking_level > 0 and self.masking_channel is None:
            raise InputError(
                f"expected sound.masking_channel for a masking noise of {self.masking_level:g} of "
                "full scale, got none; name the channel, or set sound.masking_level to 0."
            )
        for name in ("vibration_channel", "masking_channel"):
            channel = getattr(self, name)
            if channel is not None and channel > self.channels:
                raise InputError(
                    f"expected sound.{name} among the {self.channels} channels of sound.channels, "
                    f"got {channel}; correct one of the two."
                )
        if self.masking_channel == self.vibration_channel:
            raise InputError(
                f"expected the masking noise on another channel than the vibration, got channel "
                f"{self.vibration_channel} for both; correct sound.masking_channel."
            )


@dataclass(frozen=True, kw_only=True)
class VibratorSection:
    """[vibrator]: its identified resonance, and its calibration at the held pen."""

    file: str | None = field(default=None, metadata=_read_by(_text))
    g_per_volt: Figure = field(metadata=_figure("g/V", 1000.0))
    measured_on: datetime.date | None = field(default=None, metadata=_read_by(_date))


@dataclass(frozen=True, kw_only=True)
class LimitsSection:
    """[limits]: what the hand gets at most (docs/method/rendering.md#limits)."""

    peak_g: Figure = field(default=_assumed(3.0, "g"), metadata=_figure("g", 20.0))
    rms_g: Figure = field(default=_assumed(1.0, "g"), metadata=_figure("g", 10.0))
    rms_window_s: Figure = field(default=_assumed(1.0, "s"), metadata=_figure("s", 60.0))
    duration_s: Figure = field(default=_assumed(60.0, "s"), metadata=_figure("s", 3600.0))
    pause_s: Figure = field(default=_assumed(0.1, "s"), metadata=_figure("s", 60.0))


@dataclass(frozen=True, kw_only=True)
class HandSection:
    """[hand]: what measures the hand, and what is assumed where it measures nothing."""

    kind: str = field(metadata=_read_by(_kind))
    device: str | None = field(default=None, metadata=_read_by(_text))
    counts_per_mm: Figure | None = field(default=None, metadata=_figure("counts/mm", 1e5))
    filter_delay_s: Figure = field(default=_assumed(0.01, "s"), metadata=_figure("s", 0.1))
    assumed_force_n: Figure | None = field(default=None, metadata=_figure("N", 20.0))
    pressure_curve: Curve | None = field(default=None, metadata=_read_by(_pressure))
    contact_n: Figure = field(default=_assumed(0.05, "N"), metadata=_figure("N", 5.0, low=0.0))
    baud: int = field(default=115200, metadata=_whole(1200, 12_000_000))
    grab: bool = field(default=False, metadata=_read_by(_flag))
    script: str = field(default="strokes", metadata=_read_by(_text))

    def __post_init__(self) -> None:
        if self.kind in _WITHOUT_FORCE:
            self._require("counts_per_mm", "of moving it along a ruler")
            self._require("assumed_force_n", "since it measures no force")
        if self.kind == "tablet" and self.pressure_curve is None:
            self._require("assumed_force_n", "or a pressure_curve")
        force = self.assumed_force_n
        if force is not None and not force.assumed:
            raise InputError(
                "expected assumed = true for hand.assumed_force_n, which nothing measures, got "
                "false; write true, or give a device that measures force."
            )

    def _require(self, name: str, why: str) -> None:
        if getattr(self, name) is None:
            unit = {"counts_per_mm": "counts/mm", "assumed_force_n": "N"}[name]
            raise InputError(
                f"expected hand.{name} ({unit}) of a {self.kind}, {why}, got none; add it under "
                "[hand]."
            )

    @property
    def measures_force(self) -> bool:
        """Whether force comes from the device, and not from an assumption."""
        if self.kind == "tablet":
            return self.pressure_curve is not None
        return self.kind not in _WITHOUT_FORCE


@dataclass(frozen=True, kw_only=True)
class AccelerometerSection:
    """[accelerometer]: what measures at the pen. The channel counts from 1."""

    device: str | None = field(default=None, metadata=_read_by(_text))
    channel: int = field(default=1, metadata=_whole(1, 64))
    rate_hz: float = field(metadata=_read_by(_rate))
    g_per_fullscale: Figure = field(metadata=_figure("g", 10000.0))
    noise_floor_g: Figure | None = field(default=None, metadata=_figure("g", 10.0, low=0.0))


@dataclass(frozen=True, kw_only=True)
class LatencySection:
    """[latency]: from the hand to the vibration, end to end."""

    median_ms: Figure = field(metadata=_figure("ms", 10000.0))
    p95_ms: Figure = field(metadata=_figure("ms", 10000.0))
    measured_on: datetime.date | None = field(default=None, metadata=_read_by(_date))


@dataclass(frozen=True, kw_only=True)
class CalibrationSection:
    """[calibration]: when, and of which rig: its name and serial numbers at that time."""

    date: datetime.date = field(metadata=_read_by(_date))
    rig: str = field(metadata=_read_by(_text))
    serials: tuple[str, ...] = field(default=(), metadata=_read_by(_names))


@dataclass(frozen=True, kw_only=True)
class RealSurfaceSection:
    """[real_surface]: whether the hand is measured there, too."""

    hand_measured: bool = field(metadata=_read_by(_flag))


def section_from(kind: type[Section], values: Mapping[str, Any], name: str) -> Section:
    """A section from the plain values of its table, whose keys are known.

    Raises
    ------
    InputError
        For what is missing or out of range, naming key and unit.
    """
    given: dict[str, Any] = {}
    for key in fields(kind):  # type: ignore[arg-type]
        if key.name in values:
            given[key.name] = key.metadata["reader"](values[key.name], f"{name}.{key.name}")
        elif key.default is MISSING:
            raise InputError(
                f"expected {key.name} under [{name}], got none; add it as in the shipped rig file "
                "(rig/setup/desk_rig.toml)."
            )
    return kind(**given)


def plain_section(section: Any) -> dict[str, Any]:
    """A section as plain values that JSON takes too; without what is not given."""
    given = {key.name: getattr(section, key.name) for key in _keys(section)}
    return {name: _plain(value) for name, value in given.items() if value is not None}


def figures_of(section: Any) -> dict[str, Figure | Curve]:
    """The quantities of a section by their keys."""
    given = {key.name: getattr(section, key.name) for key in _keys(section)}
    return {name: value for name, value in given.items() if isinstance(value, Figure | Curve)}


def _keys(section: Any) -> tuple[Field[Any], ...]:
    return fields(section)


def _plain(value: Any) -> Any:
    if isinstance(value, Figure | Curve):
        return value.to_dict()
    if isinstance(value, datetime.date):
        return value.isoformat()
    return list(value) if isinstance(value, tuple) else value
