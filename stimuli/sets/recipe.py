"""The recipe of a stimulus set: models × trajectories × seeds, rates, sample format, level.

A recipe is a TOML file; docs/recipe-file.md lists its keys.
"""

from __future__ import annotations

import os
from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any, ClassVar, Literal

import tomlkit

from tactileq.modeling import InputError
from tactileq.modeling.checks import HIGHEST_FORCE_N, HIGHEST_SPEED_MM_S
from tactileq.modeling.errors import shown
from tactileq.modeling.files.described import DescribedFile, FileSection, key, keys_of, plain
from tactileq.modeling.files.kinds import Name
from tactileq.modeling.files.values import NameOrFile
from tactileq.modeling.recordings.trajectory import LONGEST_S
from tactileq.modeling.scenes.loading import scene_name

SampleFormat = Literal["float32", "pcm24"]
Noise = Literal["independent", "frozen"]
LevelMode = Literal["as modelled", "rms", "loudness"]

LONGEST_SETTLING_S = 60.0
HIGHEST_FILE_RATE_HZ = 768_000
HIGHEST_SEED = 2**63 - 1


@dataclass(frozen=True)
class ModelEntry(FileSection):
    """Models, by their place or from a scene; one of the two is given."""

    WHERE: ClassVar[str] = "[[model]]"
    path: Annotated[Path, key("a model file, or a folder of them")] | None = None
    label: Annotated[Name, key("as the manifest lists them; the name of the folder or scene")] = ""
    scene: (
        Annotated[Path, key("a scene, compiled from the models that it names, or a compiled one")]
        | None
    ) = None

    def __post_init__(self) -> None:
        super().__post_init__()
        if (self.path is None) == (self.scene is None):
            raise InputError(
                "expected a path or a scene under each [[model]], got "
                f"{'neither' if self.path is None else 'both'} in one; give one of the two."
            )
        if not self.label:
            object.__setattr__(self, "label", _label(self.place, of_scene=self.path is None))

    @property
    def place(self) -> Path:
        """The file or folder that it names, of either kind."""
        place = self.scene if self.path is None else self.path
        assert place is not None  # or it would have been refused
        return place


def _label(place: Path, *, of_scene: bool) -> str:
    if of_scene:
        return scene_name(place)
    place = Path(os.path.realpath(place))  # not resolve(), which raises for links in a circle
    return place.name if os.path.isdir(place) else place.parent.name


@dataclass(frozen=True, kw_only=True)
class TrajectoryEntry(FileSection):
    """A constant speed and force, or the file of a recorded hand."""

    WHERE: ClassVar[str] = "[[trajectory]]"
    name: Annotated[Name, key("as files are named; that of the file, or such as 150mms_1.5N")] = ""
    speed_mm_s: (
        Annotated[float, key("constant speed", unit="mm/s", ge=0, le=HIGHEST_SPEED_MM_S)] | None
    ) = None
    force_n: Annotated[float, key("constant force", unit="N", ge=0, le=HIGHEST_FORCE_N)] | None = (
        None
    )
    file: Annotated[Path, key("a recorded hand: time_s, speed_mm_s, force_n (CSV)")] | None = None

    def __post_init__(self) -> None:
        super().__post_init__()
        given = [name for name, value in vars(self).items() if value is not None and name != "name"]
        if set(given) not in ({"speed_mm_s", "force_n"}, {"file"}):
            raise InputError(
                f"expected speed_mm_s and force_n, or a file, in the trajectory "
                f"{shown(self.name)}, got {', '.join(given) or 'none of them'}; give the two "
                "numbers or the file."
            )
        if not self.name:
            constant = f"{self.speed_mm_s:g}mms_{self.force_n:g}N" if self.file is None else ""
            object.__setattr__(self, "name", constant or Path(self.file or "").stem)

    @staticmethod
    def constant(speed_mm_s: float, force_n: float) -> TrajectoryEntry:
        """A constant speed (mm/s) and force (N), named after them."""
        return TrajectoryEntry(speed_mm_s=speed_mm_s, force_n=force_n)


Decibels = Annotated[float, key(unit="dB", ge=-200, le=200, as_given=True)]  # beyond any vibration


@dataclass(frozen=True, kw_only=True)
class SetLevel(FileSection):
    """How loud a set is, and what a full-scale 24-bit sample stands for."""

    WHERE: ClassVar[str] = "[level]"
    mode: Annotated[
        LevelMode,
        key("the model's own level; one RMS level; or one sensation level for all stimuli"),
    ] = "as modelled"
    rms_db: (
        Annotated[Decibels, key('with mode = "rms": level of every stimulus', unit="dB re 1 g")]
        | None
    ) = None
    threshold: (
        Annotated[NameOrFile, key('with "loudness": codec, pen-hold, mobile, or a TSV (codec)')]
        | None
    ) = None
    sensation_level_db: (
        Annotated[
            Decibels, key('with "loudness": above threshold; the set\'s median', unit="dB SL")
        ]
        | None
    ) = None
    full_scale_g: (
        Annotated[
            float,
            key(
                'with format = "pcm24": value of a full-scale sample',
                unit="g",
                ge=1e-9,
                le=1e9,
                as_given=True,
            ),
        ]
        | None
    ) = None

    def __post_init__(self) -> None:
        super().__post_init__()
        uses = {"rms": ("rms_db",), "loudness": ("threshold", "sensation_level_db")}
        for mode, names in uses.items():
            for name in names:
                if self.mode != mode and getattr(self, name) is not None:
                    raise InputError(
                        f'expected {name} only with mode = "{mode}" under [level], got it with '
                        f'"{self.mode}"; remove it or change the mode.'
                    )
        if self.mode == "rms" and self.rms_db is None:
            raise InputError(
                'expected rms_db with mode = "rms" under [level], got none; add it, from -200 to '
                "200 dB re 1 g."
            )
        if self.mode == "loudness" and self.threshold is None:
            object.__setattr__(self, "threshold", NameOrFile("codec"))


def _listed(value: Any) -> Any:
    """One number or a list of them; 48000.0 is a whole number, too."""
    values = value if isinstance(value, list | tuple) else [value]
    return [int(v) if isinstance(v, float) and v.is_integer() else v for v in values]


OutputRate = Annotated[int, key(unit="Hz", ge=1, le=HIGHEST_FILE_RATE_HZ)]
Seed = Annotated[int, key(ge=0, le=HIGHEST_SEED)]


@dataclass(frozen=True, kw_only=True)
class Recipe(DescribedFile):
    """Everything that a stimulus set follows from, to the bit.

    The noise of every texture, model and trajectory is its own, or the models of one texture share
    it on each trajectory, so that nothing but the model differs between them. Shared noise makes
    two stimuli alike sample by sample, a cue that no two strokes over a surface offer; hence not
    the default. While a stimulus settles, its first condition is held: the filters settle (a band
    of B Hz takes about 1/B s).
    """

    WHAT: ClassVar[str] = "a recipe"
    WHERE: ClassVar[str] = "[set]"
    VERSION: ClassVar[int] = 1
    name: Annotated[Name, key("of the set")]
    rates_hz: Annotated[
        tuple[OutputRate, ...],
        key(
            "one rate or several, each at least the models'",
            name="rate_hz",
            min_length=1,
            reads=_listed,
            also=OutputRate,
        ),
    ] = (48_000,)
    format: Annotated[
        SampleFormat, key("samples are g, or with pcm24 24-bit shares of full_scale_g")
    ] = "float32"
    seeds: Annotated[
        tuple[Seed, ...], key("of the noise", min_length=1, reads=_listed, also=Seed)
    ] = (0,)
    noise: Annotated[Noise, key('with "frozen" the models of a texture share their noise')] = (
        "independent"
    )
    duration_s: Annotated[
        float, key("of trajectories of constant speed", unit="s", gt=0, le=LONGEST_S, as_given=True)
    ] = 1.0
    settling_s: Annotated[
        float,
        key(
            "rendered before the start and left out",
            unit="s",
            ge=0,
            le=LONGEST_SETTLING_S,
            as_given=True,
        ),
    ] = 0.5
    vibrator: (
        Annotated[Path, key("a vibrator that is to play the set: files are its drive signals")]
        | None
    ) = None
    level: Annotated[SetLevel, key("how loud")] = SetLevel()
    models: Annotated[tuple[ModelEntry, ...], key("what is rendered", name="model")]
    trajectories: Annotated[tuple[TrajectoryEntry, ...], key("by which hand", name="trajectory")]

    def __post_init__(self) -> None:
        super().__post_init__()
        names = [entry.name for entry in self.trajectories]
        lists = {"rate_hz": self.rates_hz, "seed": self.seeds, "trajectory": names}
        for what, values in {**lists, "model": self.models}.items():
            _check_different(what, values)
        if self.duration_s < 1 / min(self.rates_hz):
            raise InputError(
                f"expected a duration_s of at least one sample at {min(self.rates_hz)} Hz under "
                f"[set], got {self.duration_s:g} s; raise it."
            )
        if (self.format == "pcm24") != (self.level.full_scale_g is not None):
            raise InputError(
                'expected full_scale_g under [level] with format = "pcm24" and only there, got '
                f'full_scale_g = {self.level.full_scale_g} with "{self.format}"; a 24-bit sample '
                "is a share of it, a float sample is g."
            )

    def files(self) -> list[Path]:
        """Every file or folder that the recipe names."""
        named: list[Path | None] = [entry.place for entry in self.models]
        named += [entry.file for entry in self.trajectories]
        named += [self.level.threshold.file if self.level.threshold else None, self.vibrator]
        return [path for path in named if path is not None]

    def to_toml(self) -> str:
        """The recipe as text with every key that applies; `load` makes it again."""
        parts = [f"version = {self.VERSION}\n", _section("[set]", self)]
        parts += [_section(entry.WHERE, entry) for entry in (self.level, *self.models)]
        return "\n".join(parts + [_section(one.WHERE, one) for one in self.trajectories])


def _check_different(what: str, values: Iterable[object]) -> None:
    seen = list(values)
    doubled = [value for value in seen if seen.count(value) > 1]
    if doubled:
        raise InputError(
            f"expected each {what} once in the recipe, got {_shown(doubled[0])} twice; remove or "
            "rename one."
        )


def _shown(value: object) -> str:
    return f"{value.place} ({value.label})" if isinstance(value, ModelEntry) else repr(value)


def _section(heading: str, section: FileSection) -> str:
    values = {
        k.name: plain(getattr(section, k.field))
        for k in keys_of(type(section))
        if k.section is None
    }
    lines = [f"{n} = {tomlkit.item(v).as_string()}" for n, v in values.items() if v is not None]
    return "\n".join([heading, *lines, ""])
