"""A scene: how hands will move, the actuator, the error bound and the budget.

A scene is a TOML file; docs/scene-file.md lists its keys.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path
from typing import Annotated, Any, ClassVar

import numpy as np

from tactileq.modeling.errors import InputError
from tactileq.modeling.files.described import DescribedFile, FileSection, key, keys_of, naming
from tactileq.modeling.files.hashes import sha256_of_values
from tactileq.modeling.files.kinds import Name, Rate, TextureNames
from tactileq.modeling.files.values import NameOrFile
from tactileq.modeling.perception.thresholds import Threshold
from tactileq.modeling.rendering.limits import Limits
from tactileq.modeling.reprs import one_line
from tactileq.modeling.scenes.hands import HandTable, HandUse, check_order
from tactileq.modeling.scenes.microcontrollers import MicroController

HIGHEST_MARGIN_DB = 100.0
HIGHEST_BOUND_DB = 100.0
HIGHEST_BUDGET = 1e15
CODEC = NameOrFile("codec")


Frequency = Annotated[float, key(unit="Hz", gt=0, le=1e6)]
Positive = Annotated[float, key(gt=0, as_given=True)]
Amount = Annotated[float, key(ge=0, le=HIGHEST_BUDGET, as_given=True)]


@dataclass(frozen=True, kw_only=True)
class Actuator(FileSection):
    """What plays the output; None for no such limit."""

    WHERE: ClassVar[str] = "[actuator]"
    band_hz: (
        Annotated[
            tuple[Frequency, Frequency],
            key(
                "what it can play; without it all",
                expected="the lowest and the highest frequency, above 0 and up to 1000000 Hz,",
                unit="Hz",
                advice="give both ends",
            ),
        ]
        | None
    ) = None
    rate_hz: (
        Annotated[Rate, key("its sampling rate; without it the models'", as_given=True)] | None
    ) = None
    peak_g: Annotated[Positive, key("largest value of the output", unit="g")] | None = None
    rms_g: Annotated[Positive, key("largest RMS value of the output", unit="g")] | None = None

    def __post_init__(self) -> None:
        super().__post_init__()
        if self.band_hz is None:
            return
        check_order("band_hz under [actuator]", self.band_hz)
        if self.band_hz[0] == self.band_hz[1]:
            raise InputError(
                f"expected a band_hz from a lower to a higher frequency, got {self.band_hz[0]:g} "
                "Hz twice; give both ends."
            )

    @cached_property
    def limits(self) -> Limits:
        """As a renderer takes them."""
        given = {"peak": self.peak_g, "rms": self.rms_g}
        return Limits(**{name: float(value) for name, value in given.items() if value is not None})


@dataclass(frozen=True, kw_only=True)
class Bound(FileSection):
    """How far a compiled model may be from what is felt of the full one, wherever the hand is.

    The full model's response is known exactly, so that a GFC of 1 is attainable.
    """

    WHERE: ClassVar[str] = "[bound]"
    gfc30: Annotated[float, key("least share of the attainable GFC with σ = 30 Hz", ge=0, le=1)] = (
        0.95
    )
    bands_db: Annotated[
        float,
        key(
            "largest RMS error of the levels in nine bands, 10 … 480 Hz",
            unit="dB",
            ge=0,
            le=HIGHEST_BOUND_DB,
        ),
    ] = 1.0
    level_db: Annotated[
        float,
        key("largest error of the level of the whole band", unit="dB", ge=0, le=HIGHEST_BOUND_DB),
    ] = 1.0

    def widened(self, factor: float) -> Bound:
        """The bound with every error that it allows this many times as large."""
        angle = min(np.arccos(self.gfc30) * factor, np.pi / 2)
        return Bound(
            gfc30=float(np.cos(angle)),
            bands_db=min(self.bands_db * factor, HIGHEST_BOUND_DB),
            level_db=min(self.level_db * factor, HIGHEST_BOUND_DB),
        )


@dataclass(frozen=True, kw_only=True)
class Budget(FileSection):
    """What a scene may cost at most; a micro-controller gives what is not given."""

    WHERE: ClassVar[str] = "[budget]"
    operations: Annotated[Amount, key("operations per sample of any texture")] | None = None
    device: Annotated[str, key("or a micro-controller (modeling/scenes/shipped)")] | None = None
    bytes: Annotated[Amount, key("bytes of tables and state of all textures")] | None = None

    def __post_init__(self) -> None:
        super().__post_init__()
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


@dataclass(frozen=True, kw_only=True)
class SceneFile(DescribedFile):
    """What a scene file holds; `Scene.load` makes the scene of it."""

    WHAT: ClassVar[str] = "a scene"
    WHERE: ClassVar[str] = "[scene]"
    VERSION: ClassVar[int] = 1
    name: Annotated[Name, key("what tables and compiled models call it")]
    models: (
        Annotated[Path, key("folder of full models; without it given on the command line")] | None
    ) = None
    textures: Annotated[TextureNames, key("their names; without it all of the folder")] = ()
    threshold: Annotated[
        NameOrFile, key("codec, pen-hold, mobile, or a TSV; what is below it is dropped")
    ] = CODEC
    margin_db: Annotated[
        float,
        key(
            "how far below the threshold a layer must be to be dropped",
            unit="dB",
            ge=0,
            le=HIGHEST_MARGIN_DB,
        ),
    ] = 0.0
    hand: Annotated[HandTable, key("what hands will do")]
    actuator: Annotated[Actuator, key("what plays the output")] = Actuator()
    bound: Annotated[Bound, key("how far from the full model")] = Bound()
    budget: Annotated[Budget, key("what it may cost")] = Budget()


@dataclass(frozen=True, eq=False, kw_only=True)
class Scene:
    """What is to be rendered, for which hand, by which actuator, how well and at what cost.

    Parameters
    ----------
    name, textures, margin_db, actuator, bound, budget, models
        As a scene file has them (docs/scene-file.md).
    hand : HandRange or HandPlaces
        What hands will do.
    threshold : Threshold
        What is below it in this scene is dropped.
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

    __repr__ = one_line

    def __post_init__(self) -> None:
        for name in ("name", "textures", "margin_db"):
            held = SceneFile.of_field(name, getattr(self, name))
            object.__setattr__(self, name, held)

    def to_dict(self) -> dict[str, Any]:
        """Plain values of all that a compiled model follows from, but the models."""
        return {
            "name": self.name,
            "textures": list(self.textures),
            "threshold": self.threshold.name,
            "threshold_sha256": self.threshold.sha256,
            "margin_db": self.margin_db,
            "hand": self.hand.to_dict(),
            "actuator": self.actuator.to_dict(),
            "bound": self.bound.to_dict(),
            "budget": self.budget.to_dict(),
        }

    @cached_property
    def sha256(self) -> str:
        """SHA-256 of its values, by which compiled models name the scene that they are for."""
        return sha256_of_values(self.to_dict())

    @staticmethod
    def load(path: str | Path) -> Scene:
        """Read a scene file (TOML); its paths are relative to it.

        Raises
        ------
        InputError
            If the file is missing, no TOML or of another version, has unknown or missing keys, or
            values that are out of range or contradict each other; likewise of the recorded hand
            and the threshold that it names.
        """
        file = Path(path)
        stated = SceneFile.load(file)
        with naming(file):
            named = [one for one in (stated.hand.file, stated.threshold.file) if one is not None]
            own = {key.field: getattr(stated, key.field) for key in keys_of(SceneFile)}
            return Scene(
                **own
                | {
                    "hand": stated.hand.hand(),
                    "threshold": Threshold.named(stated.threshold),
                    "files": (file, *named),
                }
            )
