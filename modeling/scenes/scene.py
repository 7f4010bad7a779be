"""A scene: how hands will move, the actuator, the error bound and the budget.

A scene is a TOML file; its paths are relative to it, and unknown keys are refused::

    version = 1

    [scene]
    name = "slow light touch"
    models = "models"              # folder of full models (given on the command line)
    textures = ["canvas", "PVC"]   # (all of the folder)
    threshold = "codec"            # codec, pen-hold, mobile, or a TSV ("codec")
    margin_db = 0.0                # how far below it a layer must be to be dropped (0)

    [hand]                         # one of three: a range,
    speed_mm_s = [50, 150]         #   speeds; the hand may stay anywhere in the range
    force_n = [0.5, 1.0]           #   forces; "recorded": all at which a texture was recorded
    stroke_hz = 2.0                #   strokes back and forth per second (2)
    file = "hand.csv"              # a recorded hand: time_s, speed_mm_s, force_n,
    [[hand.place]]                 # or a distribution: places with their shares of the time
    speed_mm_s = 100
    force_n = 1.0
    share = 0.7

    [actuator]
    band_hz = [40, 400]            # what it can play (all)
    rate_hz = 5000                 # its sampling rate (the models')
    peak_g = 5.0                   # limits of the output (none)
    rms_g = 2.0

    [bound]                        # relative to what is felt of the full model, at every place
    gfc30 = 0.95                   # share of the attainable goodness of fit (0.95)
    bands_db = 1.0                 # RMS error of the levels in nine bands, 10 … 480 Hz (1)
    level_db = 1.0                 # error of the level (1)

    [budget]                       # (none)
    operations = 150               # per sample,
    device = "stm32l432"           #   or a micro-controller, which also limits the bytes
    bytes = 16384                  # of tables and state of all textures

Values in brackets are the defaults; `version`, `name` and a hand are required.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, fields, replace
from functools import cached_property
from pathlib import Path
from typing import Any, Literal

import numpy as np
from numpy.typing import ArrayLike

from modeling.arrays import Floats
from modeling.checks import (
    HIGHEST_FORCE_N,
    HIGHEST_SPEED_MM_S,
    check_keys,
    check_name,
    check_number,
    check_rate,
    check_texture_name,
    is_number,
    is_positive,
)
from modeling.errors import InputError, shown
from modeling.files.documents import as_text, check_version, read_toml, toml_section
from modeling.files.hashes import sha256_of, sha256_of_values
from modeling.perception.thresholds import Threshold
from modeling.recordings.trajectory import Trajectory, load_trajectory
from modeling.rendering.limits import Limits
from modeling.scenes.microcontrollers import MicroController

VERSION = 1
STROKE_HZ = 2.0
FASTEST_STROKES_HZ = 20.0
HIGHEST_MARGIN_DB = 100.0
HIGHEST_BOUND_DB = 100.0
HIGHEST_BUDGET = 1e15
READ_EVERY_S = 5e-3  # a recorded hand, for its speed, force and their slopes
_SECTIONS = {
    "scene": ("name", "models", "textures", "threshold", "margin_db"),
    "hand": ("speed_mm_s", "force_n", "stroke_hz", "file", "place"),
    "actuator": ("band_hz", "rate_hz", "peak_g", "rms_g"),
    "bound": ("gfc30", "bands_db", "level_db"),
    "budget": ("operations", "device", "bytes"),
}
_PLACE = ("speed_mm_s", "force_n", "share")
RECORDED = "recorded"
Range = tuple[float, float]
AskedRange = Range | Literal["recorded"]


@dataclass(frozen=True, kw_only=True)
class HandRange:
    """A hand that may stay anywhere within a range of speeds (mm/s) and forces (N).

    Parameters
    ----------
    speed_mm_s, force_n : (float, float) or "recorded"
        Lowest and highest, 0 < lowest ≤ highest; or all at which a texture was recorded.
    stroke_hz : float
        How often a second it goes back and forth, up to the highest speed, and presses up and down
        through all forces: what a parameter update comes too late for. 0 … 20.
    """

    speed_mm_s: AskedRange
    force_n: AskedRange
    stroke_hz: float = STROKE_HZ

    def __post_init__(self) -> None:
        highest = {"speed_mm_s": HIGHEST_SPEED_MM_S, "force_n": HIGHEST_FORCE_N}
        for name, most in highest.items():
            if (value := getattr(self, name)) != RECORDED:
                object.__setattr__(self, name, _range(f"{name} under [hand]", value, most))
        check_number("stroke_hz under [hand]", self.stroke_hz, high=FASTEST_STROKES_HZ)

    def to_dict(self) -> dict[str, Any]:
        """Plain values, those of a scene file."""
        asked = {"speed_mm_s": self.speed_mm_s, "force_n": self.force_n}
        return {
            **{key: ends if isinstance(ends, str) else list(ends) for key, ends in asked.items()},
            "stroke_hz": float(self.stroke_hz),
        }


@dataclass(frozen=True, eq=False, kw_only=True)
class HandPlaces:
    """A hand by the places where it is, and for what share of its time.

    Parameters
    ----------
    speed_mm_s, force_n : (n,) array_like
        > 0; what is not contact is no place.
    share : (n,) array_like
        > 0; any sum.
    speed_change_mm_s2, force_change_n_s : (n,) array_like
        How fast the hand's speed and force change there, ≥ 0.
    kind : str
        Where it comes from, for tables: "recorded" or "distribution".
    """

    speed_mm_s: Floats
    force_n: Floats
    share: Floats
    speed_change_mm_s2: Floats
    force_change_n_s: Floats
    kind: str

    def __post_init__(self) -> None:
        for name in _HAND_ARRAYS:
            value = np.array(getattr(self, name), dtype=np.float64)
            value.setflags(write=False)
            object.__setattr__(self, name, value)
        if not self.share.size:
            raise InputError(
                "expected a hand that touches and moves, got none that does; give one that strokes."
            )
        object.__setattr__(self, "share", self.share / self.share.sum())

    @property
    def ranges(self) -> tuple[Range, Range]:
        """Lowest and highest speed and force."""
        speed, force = self.speed_mm_s, self.force_n
        return (float(speed.min()), float(speed.max())), (float(force.min()), float(force.max()))

    def to_dict(self) -> dict[str, Any]:
        """Plain values: those of a distribution, of a recorded hand what it covers and its hash."""
        if self.kind == "distribution":
            places = zip(self.speed_mm_s, self.force_n, self.share, strict=True)
            return {"place": [dict(zip(_PLACE, map(float, p), strict=True)) for p in places]}
        speed, force = self.ranges
        content = repr([getattr(self, name).tolist() for name in _HAND_ARRAYS])
        return {
            "recorded": sha256_of(content),
            "speed_mm_s": list(speed),
            "force_n": list(force),
        }


_HAND_ARRAYS = tuple(f.name for f in fields(HandPlaces) if f.name != "kind")
HandUse = HandRange | HandPlaces


def recorded_hand(trajectory: Trajectory) -> HandPlaces:
    """What a recorded hand does, read every 5 ms while it touches and moves."""
    time_s = np.arange(0.0, trajectory.duration_s + READ_EVERY_S / 2, READ_EVERY_S)
    speed, force = trajectory.at(time_s)
    if time_s.size > 1:
        changes = [np.abs(np.gradient(x, READ_EVERY_S)) for x in (speed, force)]
    else:
        changes = [np.zeros(1), np.zeros(1)]
    with np.errstate(invalid="ignore"):
        touches = (np.abs(speed) > 0) & (force > 0) & np.isfinite(speed) & np.isfinite(force)
    return HandPlaces(
        speed_mm_s=np.abs(speed[touches]),
        force_n=force[touches],
        share=np.ones(int(touches.sum())),
        speed_change_mm_s2=np.nan_to_num(changes[0][touches], posinf=0.0),
        force_change_n_s=np.nan_to_num(changes[1][touches], posinf=0.0),
        kind="recorded",
    )


def distributed_hand(
    speed_mm_s: ArrayLike, force_n: ArrayLike, share: ArrayLike, *, stroke_hz: float = STROKE_HZ
) -> HandPlaces:
    """A hand by its shares of the time at (n,) speeds and forces; strokes as in `HandRange`."""
    speed, force = np.asarray(speed_mm_s, dtype=float), np.asarray(force_n, dtype=float)
    omega = 2 * np.pi * stroke_hz
    speed_change = omega * np.sqrt(speed.max() ** 2 - speed**2)
    return HandPlaces(
        speed_mm_s=speed,
        force_n=force,
        share=np.asarray(share, dtype=float),
        speed_change_mm_s2=speed_change,
        force_change_n_s=np.full(force.size, omega * np.ptp(force) / 2),
        kind="distribution",
    )


@dataclass(frozen=True, kw_only=True)
class Actuator:
    """What plays the output: its usable band (Hz), sampling rate and limits; None for no such."""

    band_hz: Range | None = None
    rate_hz: float | None = None
    peak_g: float | None = None
    rms_g: float | None = None

    def __post_init__(self) -> None:
        if self.band_hz is not None:
            band = _range("band_hz under [actuator]", self.band_hz, 1e6)
            if band[0] == band[1]:
                raise InputError(
                    f"expected a band_hz from a lower to a higher frequency, got {band[0]:g} Hz "
                    "twice; give both ends."
                )
            object.__setattr__(self, "band_hz", band)
        if self.rate_hz is not None:
            check_rate(self.rate_hz)
        for name in ("peak_g", "rms_g"):
            value = getattr(self, name)
            if value is not None and not is_positive(value):
                raise InputError(
                    f"expected {name} above 0 under [actuator], got {shown(value)}; correct it."
                )

    @cached_property
    def limits(self) -> Limits:
        """As a renderer takes them."""
        given = {"peak": self.peak_g, "rms": self.rms_g}
        return Limits(**{name: float(value) for name, value in given.items() if value is not None})


@dataclass(frozen=True, kw_only=True)
class Bound:
    """How far a compiled model may be from what is felt of the full one, wherever the hand is.

    Parameters
    ----------
    gfc30 : float
        Least share of the attainable GFC with σ = 30 Hz, 0 … 1. The full model's response is
        known exactly, so that 1 is attainable.
    bands_db : float
        Largest RMS error of the levels in nine bands, 10 … 480 Hz, dB ≥ 0.
    level_db : float
        Largest error of the level of the whole band, dB ≥ 0.
    """

    gfc30: float = 0.95
    bands_db: float = 1.0
    level_db: float = 1.0

    def __post_init__(self) -> None:
        if is_number(self.gfc30) and self.gfc30 > 1:
            raise InputError(
                f"expected gfc30 of at most 1 under [bound], which the full model itself reaches, "
                f"got {shown(self.gfc30)}; lower it."
            )
        check_number("gfc30 under [bound]", self.gfc30, high=1.0)
        for name in ("bands_db", "level_db"):
            check_number(f"{name} under [bound]", getattr(self, name), high=HIGHEST_BOUND_DB)

    def to_dict(self) -> dict[str, float]:
        """Plain values, those of a scene file."""
        return {f.name: float(getattr(self, f.name)) for f in fields(self)}

    def widened(self, factor: float) -> Bound:
        """The bound with every error that it allows this many times as large."""
        angle = min(np.arccos(self.gfc30) * factor, np.pi / 2)
        return Bound(
            gfc30=float(np.cos(angle)),
            bands_db=min(self.bands_db * factor, HIGHEST_BOUND_DB),
            level_db=min(self.level_db * factor, HIGHEST_BOUND_DB),
        )


@dataclass(frozen=True, kw_only=True)
class Budget:
    """What a scene may cost at most: operations per sample of any texture, bytes of all; or None.

    `device` names a micro-controller (`scenes.microcontrollers`), which gives what is not given.
    """

    operations: float | None = None
    device: str | None = None
    bytes: int | None = None

    def __post_init__(self) -> None:
        for name in ("operations", "bytes"):
            value = getattr(self, name)
            if value is not None:
                check_number(f"{name} under [budget]", value, high=HIGHEST_BUDGET)
        if self.device is not None:
            if self.operations is not None:
                raise InputError(
                    "expected operations or a device under [budget], got both, which may "
                    "contradict each other; remove one."
                )
            MicroController.named(self.device)

    def most_operations(self, rate_hz: float) -> float:
        """Operations per sample at a rate; infinite where there is no limit."""
        if self.device is not None:
            return MicroController.named(self.device).operations_per_sample(rate_hz)
        return np.inf if self.operations is None else float(self.operations)

    @property
    def most_bytes(self) -> float:
        """Infinite where there is no limit."""
        if self.bytes is not None:
            return float(self.bytes)
        if self.device is not None:
            return float(MicroController.named(self.device).memory_bytes)
        return np.inf


@dataclass(frozen=True, eq=False, kw_only=True)
class Scene:
    """What is to be rendered, for which hand, by which actuator, how well and at what cost.

    Parameters
    ----------
    name : str
    hand : HandRange or HandPlaces
        What hands will do.
    textures : tuple of str
        Their names; empty for all that there are models of.
    threshold : Threshold
        What is below it in this scene is dropped.
    margin_db : float
        How far below; ≥ 0.
    actuator : Actuator
    bound : Bound
    budget : Budget
    models : Path, optional
        Folder of the full models.
    files : tuple of Path
        Where all of this comes from: the scene's file, and those that it names.

    Raises
    ------
    InputError
        For values out of range, and for those that contradict each other.
    """

    name: str
    hand: HandUse
    textures: tuple[str, ...] = ()
    threshold: Threshold = field(default_factory=lambda: Threshold.named("codec"))
    margin_db: float = 0.0
    actuator: Actuator = field(default_factory=Actuator)
    bound: Bound = field(default_factory=Bound)
    budget: Budget = field(default_factory=Budget)
    models: Path | None = None
    files: tuple[Path, ...] = ()

    def __post_init__(self) -> None:
        check_name("name of the scene", self.name)
        check_number("margin_db under [scene]", self.margin_db, high=HIGHEST_MARGIN_DB)
        object.__setattr__(self, "textures", tuple(self.textures))
        for texture in self.textures:
            check_texture_name(texture)
            if self.textures.count(texture) > 1:
                raise InputError(
                    f"expected each texture of the scene once, got {shown(texture)} twice; remove "
                    "one."
                )

    def to_dict(self) -> dict[str, Any]:
        """Plain values of all that a compiled model follows from, but the models."""
        actuator = {
            name: list(value) if isinstance(value, tuple) else value
            for name, value in vars(self.actuator).items()
            if name in _SECTIONS["actuator"]
        }
        return {
            "name": self.name,
            "textures": list(self.textures),
            "threshold": self.threshold.name,
            "threshold_sha256": self.threshold.sha256,
            "margin_db": float(self.margin_db),
            "hand": self.hand.to_dict(),
            "actuator": actuator,
            "bound": self.bound.to_dict(),
            "budget": dict(vars(self.budget)),
        }

    @cached_property
    def sha256(self) -> str:
        """SHA-256 of its values, by which compiled models name the scene that they are for."""
        return sha256_of_values(self.to_dict())

    @staticmethod
    def load(path: str | Path) -> Scene:
        """Read a scene file (TOML).

        Raises
        ------
        InputError
            If the file is missing, no TOML or of another version, has unknown or missing keys, or
            values that are out of range or contradict each other; likewise of the recorded hand
            and the threshold that it names.
        """
        file = Path(path)
        values = read_toml(file, "a scene")
        try:
            return replace(_scene_from(values, file.parent), files=_files(values, file))
        except InputError as error:
            raise InputError(f"{file}: {error}") from None


def _scene_from(values: Mapping[str, Any], folder: Path) -> Scene:
    check_keys(values, ("version", *_SECTIONS), where="a scene")
    check_version(values, VERSION, what="scene")
    sections = {name: toml_section(values, name, keys) for name, keys in _SECTIONS.items()}
    settings = sections["scene"]
    if "name" not in settings:
        raise InputError("expected a name under [scene], got none; name the scene.")
    textures = settings.get("textures", [])
    if not isinstance(textures, list):
        raise InputError(
            f"expected a list of textures under [scene], got {shown(textures)}; write textures = "
            '["…", "…"].'
        )
    threshold = as_text(settings.get("threshold", "codec"), "threshold under [scene]")
    models = settings.get("models")
    return Scene(
        name=settings["name"],
        hand=_hand(sections["hand"], folder),
        textures=tuple(textures),
        threshold=Threshold.named(folder / threshold if Path(threshold).suffix else threshold),
        margin_db=settings.get("margin_db", 0.0),
        actuator=Actuator(**sections["actuator"]),
        bound=Bound(**sections["bound"]),
        budget=Budget(**sections["budget"]),
        models=None if models is None else folder / as_text(models, "models under [scene]"),
    )


def _files(values: Mapping[str, Any], file: Path) -> tuple[Path, ...]:
    """A scene file of good values and the hand and the threshold that it names."""
    named = (values["hand"].get("file", ""), values["scene"].get("threshold", ""))
    return file, *(file.parent / name for name in named if Path(name).suffix)


def _hand(values: dict[str, Any], folder: Path) -> HandUse:
    """The one hand of a scene file."""
    ranged = {"speed_mm_s", "force_n"} & set(values)
    kinds = [bool(ranged), "file" in values, "place" in values]
    if sum(kinds) != 1 or (ranged and len(ranged) < 2):
        raise InputError(
            "expected one hand under [hand]: speed_mm_s and force_n, or a file, or tables "
            f"[[hand.place]], got {', '.join(values) or 'none'}; give one of the three."
        )
    if "file" in values:
        if "stroke_hz" in values:
            raise InputError(
                "expected no stroke_hz beside a recorded hand, whose strokes are known, got "
                f"{shown(values['stroke_hz'])}; remove it."
            )
        file = folder / as_text(values["file"], "file under [hand]")
        return recorded_hand(load_trajectory(file, name=file.stem))
    if "place" in values:
        return _distribution(values["place"], values.get("stroke_hz", STROKE_HZ))
    return HandRange(**values)


def _distribution(places: object, stroke_hz: float) -> HandPlaces:
    if not (isinstance(places, list) and places and all(isinstance(p, Mapping) for p in places)):
        raise InputError(
            f"expected tables [[hand.place]], got {shown(places)}; write [[hand.place]] above the "
            "keys of each."
        )
    check_number("stroke_hz under [hand]", stroke_hz, high=FASTEST_STROKES_HZ)
    for place in places:
        check_keys(place, _PLACE, where="[[hand.place]]")
        for name, highest in zip(_PLACE, (HIGHEST_SPEED_MM_S, HIGHEST_FORCE_N, 1e9), strict=True):
            if not (is_positive(place.get(name)) and place[name] <= highest):
                raise InputError(
                    f"expected {name} above 0 and up to {highest:g} under each [[hand.place]], got "
                    f"{shown(place.get(name))}; correct it."
                )
    columns = [np.array([float(place[name]) for place in places]) for name in _PLACE]
    return distributed_hand(*columns, stroke_hz=stroke_hz)


def _range(what: str, value: object, highest: float) -> Range:
    """Lowest and highest, from both or from one number."""
    ends = [value, value] if is_number(value) else value
    pair = list(ends) if isinstance(ends, list | tuple) else []
    if len(pair) != 2 or not all(is_positive(end) and end <= highest for end in pair):
        raise InputError(
            f"expected the lowest and the highest {what}, above 0 and up to {highest:g}, got "
            f'{shown(value)}; write [lowest, highest], or "{RECORDED}" for all of the grid.'
        )
    low, high = float(pair[0]), float(pair[1])
    if low > high:
        raise InputError(
            f"expected the lowest {what} before the highest, got {low:g} before {high:g}; swap "
            "them."
        )
    return low, high
