"""The sections of a rig file: the meaning of each key, its unit, its range and its default."""

from __future__ import annotations

import datetime
from dataclasses import dataclass, field
from typing import Annotated, ClassVar, Literal

from tactileq.modeling import InputError
from tactileq.modeling.files.described import FileSection, key
from tactileq.modeling.files.kinds import Name, Rate
from tactileq.rig.shared.setup.figures import Curve, Figure

LOUDEST_MASKING = 0.5
CALIBRATION_DAYS = 90.0  # how old a calibration may be where no study says otherwise
HandKind = Literal["tablet", "mouse", "serial", "window", "scripted", "force"]
_WITHOUT_FORCE = ("mouse", "window")
_LEAST = 1e-6  # far below any rig's, and far above what a division by it could not hold
Channel = Annotated[int, key(ge=1, le=64)]


def _assumed(value: float, unit: str) -> Figure:
    return Figure(value, unit, True, "default of tactileq, measured nowhere")


@dataclass(frozen=True, kw_only=True)
class RigName(FileSection):
    """Which rig this is."""

    WHERE: ClassVar[str] = "[rig]"
    name: Annotated[
        Name, key("name of the rig; two processes cannot use a rig of one name at once")
    ]
    serials: Annotated[
        tuple[Name, ...],
        key("serial numbers of all that the calibration depends on (vibrator, amplifier, card)"),
    ] = ()


@dataclass(frozen=True, kw_only=True)
class SoundSection(FileSection):
    """The sound card. Channels count from 1."""

    WHERE: ClassVar[str] = "[sound]"
    device: (
        Annotated[
            Name,
            key(
                "name of the sound card, or a part of it that is in no other name; "
                '"NAME, HOST" where a system lists a card several times; without it the system\'s '
                "output"
            ),
        ]
        | None
    ) = None
    rate_hz: Annotated[Rate, key("sampling rate; at least that of the models")]
    block: Annotated[
        int,
        key(
            "between two calls of the callback; fewer reduce latency but increase the risk of "
            "missed blocks",
            unit="samples",
            ge=16,
            le=4096,
        ),
    ] = 128
    channels: Annotated[Channel, key("output channels that are opened")] = 2
    vibration_channel: Annotated[Channel, key("which one drives the vibrator")] = 1
    masking_channel: Annotated[Channel, key("which one plays noise for headphones")] | None = None
    masking_level: Annotated[
        float,
        key("RMS of that noise during sessions", unit="of full scale", ge=0, le=LOUDEST_MASKING),
    ] = 0.0
    fullscale_v: Annotated[
        Figure,
        key(
            "voltage at the vibrator for a sample of full scale, amplifier included",
            unit="V",
            ge=_LEAST,
            le=1000,
        ),
    ]
    simulated: Annotated[bool, key("whether no sound card plays: data are marked as simulated")] = (
        False
    )

    def __post_init__(self) -> None:
        super().__post_init__()
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
class VibratorSection(FileSection):
    """The vibrator: its identified resonance, and its calibration at the held pen."""

    WHERE: ClassVar[str] = "[vibrator]"
    file: (
        Annotated[Name, key("from `tactileq vibrator`; its resonance is then compensated")] | None
    ) = None
    g_per_volt: Annotated[
        Figure,
        key(
            "acceleration at the held pen, in the flat part of the vibrator",
            unit="g/V",
            ge=_LEAST,
            le=1000,
        ),
    ]
    measured_on: Annotated[datetime.date, key("when")] | None = None


@dataclass(frozen=True, kw_only=True)
class LimitsSection(FileSection):
    """What the hand gets at most ([why](method/rendering.md#limits))."""

    WHERE: ClassVar[str] = "[limits]"
    peak_g: Annotated[
        Figure, key("largest acceleration at the output", unit="g", ge=_LEAST, le=20)
    ] = field(default=_assumed(3.0, "g"))
    rms_g: Annotated[
        Figure,
        key("largest running RMS, weights exp(−age / rms_window_s)", unit="g", ge=_LEAST, le=10),
    ] = field(default=_assumed(1.0, "g"))
    rms_window_s: Annotated[
        Figure,
        key(
            "time constant of those weights, which are not a finite window",
            unit="s",
            ge=_LEAST,
            le=60,
        ),
    ] = field(default=_assumed(1.0, "s"))
    duration_s: Annotated[
        Figure,
        key("longest vibration without a pause; then it is muted", unit="s", ge=_LEAST, le=3600),
    ] = field(default=_assumed(60.0, "s"))
    pause_s: Annotated[
        Figure, key("shortest silence that counts as a pause", unit="s", ge=_LEAST, le=60)
    ] = field(default=_assumed(0.1, "s"))
    exposure_m_s2: (
        Annotated[
            Figure,
            key(
                "highest [daily exposure](method/rendering.md#exposure) A(8) of a participant, "
                "after which a session ends; without it 2.5 m/s², the action value of the "
                "European directive",
                unit="m/s²",
                ge=_LEAST,
                le=5,
            ),
        ]
        | None
    ) = None


@dataclass(frozen=True, kw_only=True)
class HandSection(FileSection):
    """What measures the hand, and what is assumed where it measures nothing."""

    WHERE: ClassVar[str] = "[hand]"
    kind: Annotated[
        HandKind, key("window: not for studies; scripted: simulated; force: needs [force]")
    ]
    device: (
        Annotated[Name, key("path or name of the device; without it the only one that fits")] | None
    ) = None
    counts_per_mm: (
        Annotated[
            Figure,
            key(
                "steps of the device in 1 mm; required for a mouse and a window (pixels), without "
                "it the tablet's own",
                unit="counts/mm",
                ge=_LEAST,
                le=1e5,
            ),
        ]
        | None
    ) = None
    filter_delay_s: Annotated[
        Figure,
        key("delay of the [tracking filter](method/hand.md#delay)", unit="s", ge=_LEAST, le=0.1),
    ] = field(default=_assumed(0.01, "s"))
    assumed_force_n: (
        Annotated[
            Figure,
            key(
                "where nothing measures force: a mouse, a window, a tablet without pressure_curve",
                unit="N",
                ge=_LEAST,
                le=20,
            ),
        ]
        | None
    ) = None
    pressure_curve: (
        Annotated[
            Curve,
            key(
                "force over pressure, straight lines between the points",
                unit="N",
                expected="two or more points [pressure as a share of its range, force in N] of "
                "rising pressure and never falling force",
            ),
        ]
        | None
    ) = None
    contact_n: Annotated[
        Figure, key("below this force the hand does not touch", unit="N", ge=0, le=5)
    ] = field(default=_assumed(0.05, "N"))
    baud: Annotated[int, key("speed of a serial port", ge=1200, le=12_000_000)] = 115200
    grab: Annotated[
        bool, key("whether, while in use, a tablet or mouse does not move the pointer")
    ] = False
    script: Annotated[Name, key("of a scripted hand: strokes, hold, or a table's path")] = "strokes"

    def __post_init__(self) -> None:
        super().__post_init__()
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
        """Whether force comes from the device, commanded by or sensed at it, not an assumption."""
        if self.kind == "tablet":
            return self.pressure_curve is not None
        return self.kind not in _WITHOUT_FORCE


@dataclass(frozen=True, kw_only=True)
class AccelerometerSection(FileSection):
    """What measures at the pen, which sessions then record."""

    WHERE: ClassVar[str] = "[accelerometer]"
    device: (
        Annotated[Name, key("sound card of the accelerometer; without it the system's input")]
        | None
    ) = None
    channel: Annotated[Channel, key("which of its channels, from 1")] = 1
    rate_hz: Annotated[Rate, key("sampling rate")]
    g_per_fullscale: Annotated[
        Figure, key("acceleration of a full-scale sample", unit="g", ge=_LEAST, le=10000)
    ]
    noise_floor_g: Annotated[Figure, key("RMS without contact", unit="g", ge=0, le=10)] | None = (
        None
    )


@dataclass(frozen=True, kw_only=True)
class LatencySection(FileSection):
    """From the hand to the vibration, end to end; `tactileq rig latency` writes it."""

    WHERE: ClassVar[str] = "[latency]"
    median_ms: Annotated[Figure, key("median latency", unit="ms", ge=_LEAST, le=10000)]
    p95_ms: Annotated[
        Figure,
        key("its 95th percentile; above 40 ms the rig is refused", unit="ms", ge=_LEAST, le=10000),
    ]
    measured_on: Annotated[datetime.date, key("when")] | None = None
    rests_on: (
        Annotated[
            tuple[Name, ...],
            key(
                "the keys of card and hand on which it "
                "[rests](rig-file.md#what-the-level-rests-on), with their values at that time; "
                "without it their changes go unnoticed"
            ),
        ]
        | None
    ) = None


@dataclass(frozen=True, kw_only=True)
class CalibrationSection(FileSection):
    """When the rig was calibrated, and as which one; `tactileq rig calibrate` writes it."""

    WHERE: ClassVar[str] = "[calibration]"
    date: Annotated[datetime.date, key("when")]
    rig: Annotated[Name, key("name of the rig at that time")]
    serials: Annotated[tuple[Name, ...], key("its serial numbers at that time")] = ()
    rests_on: (
        Annotated[
            tuple[Name, ...],
            key(
                "the keys on which the level [rests](rig-file.md#what-the-level-rests-on), with "
                "their values at that time; without it their changes go unnoticed"
            ),
        ]
        | None
    ) = None


@dataclass(frozen=True, kw_only=True)
class RealSurfaceSection(FileSection):
    """The real surface beside the virtual one."""

    WHERE: ClassVar[str] = "[real_surface]"
    hand_measured: Annotated[
        bool,
        key("whether the hand is also measured there; otherwise its history there is n/a"),
    ]
    offset_mm: (
        Annotated[
            Figure, key("how far it lies below the wall of a force device", unit="mm", ge=0, le=500)
        ]
        | None
    ) = None
    stiffness: (
        Annotated[
            Figure,
            key(
                "of the springs that carry it; `tactileq rig stiffness` writes it",
                unit="N/mm",
                ge=_LEAST,
                le=100,
            ),
        ]
        | None
    ) = None
