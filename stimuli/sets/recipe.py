"""The recipe of a stimulus set: models × trajectories × seeds, rates, sample format, level.

A recipe is a TOML file; its paths are relative to it, and unknown keys are refused::

    version = 1

    [set]
    name = "paper"
    rate_hz = [5000, 44100, 48000]  # one rate or several, each at least the models' (48000)
    format = "float32"              # samples are g; "pcm24": shares of full_scale_g
    seeds = [1, 2]                  # ([0])
    noise = "independent"           # "frozen": the models of a texture share their noise
    duration_s = 1.0                # of trajectories of constant speed (1)
    settling_s = 0.5                # rendered before the start and left out (0.5)
    vibrator = "vibrator.json"      # each file is the drive signal for it (none)

    [level]
    mode = "as modelled"            # "rms", "loudness"
    rms_db = -20.0                  # with "rms": level of every stimulus, dB re 1 g
    threshold = "codec"             # with "loudness": codec, pen-hold, or a TSV ("codec")
    sensation_level_db = 20.0       # with "loudness": dB SL (the set's median)
    full_scale_g = 4.0              # with "pcm24": acceleration of a full-scale sample

    [[model]]
    path = "models"                 # a model file, or a folder of them
    label = "full"                  # (name of the folder)

    [[model]]
    scene = "light.toml"            # instead of path: a scene, compiled from the models that it
    label = "light"                 #   names, or the folder of a compiled one (name of the scene)

    [[trajectory]]
    speed_mm_s = 150
    force_n = 1.5
    name = "150mms_1.5N"            # (as here)

    [[trajectory]]
    file = "hand.csv"               # time_s, speed_mm_s, force_n
    name = "hand"                   # (name of the file)

Values in brackets are the defaults; `name` under [set], `version`, one [[model]] and one
[[trajectory]] are required.
"""

from __future__ import annotations

import json
import os
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Literal, get_args

from modeling import InputError
from modeling.checks import (
    HIGHEST_FORCE_N,
    HIGHEST_SPEED_MM_S,
    check_choice,
    check_keys,
    check_name,
    check_number,
    check_whole,
    is_number,
    is_whole,
)
from modeling.errors import shown
from modeling.files.documents import as_text, check_version, read_toml, toml_section
from modeling.recordings.trajectory import LONGEST_S
from modeling.scenes.loading import scene_name

SampleFormat = Literal["float32", "pcm24"]
Noise = Literal["independent", "frozen"]
LevelMode = Literal["as modelled", "rms", "loudness"]

VERSION = 1
LONGEST_SETTLING_S = 60.0
HIGHEST_RATE_HZ = 768_000
HIGHEST_SEED = 2**63 - 1
# Beyond any vibration: limits that keep gains finite.
LEVELS_DB = (-200.0, 200.0)
FULL_SCALES_G = (1e-9, 1e9)
_SECTIONS = {
    "set": (
        "name",
        "rate_hz",
        "format",
        "seeds",
        "noise",
        "duration_s",
        "settling_s",
        "vibrator",
    ),
    "level": ("mode", "rms_db", "threshold", "sensation_level_db", "full_scale_g"),
    "model": ("path", "scene", "label"),
    "trajectory": ("name", "speed_mm_s", "force_n", "file"),
}


@dataclass(frozen=True)
class ModelEntry:
    """Models, and the label under which the manifest lists them.

    `path` is a model file or a folder of them; `scene` a scene file or the folder of a compiled
    scene. One of the two is given.
    """

    path: Path | None
    label: str
    scene: Path | None = None

    def __post_init__(self) -> None:
        check_name("label of a model", self.label)
        _check_one_place(self.path, self.scene)

    @property
    def place(self) -> Path:
        """The file or folder that it names, of either kind."""
        place = self.scene if self.path is None else self.path
        assert place is not None  # or it would have been refused
        return place


def _check_one_place(path: Path | None, scene: Path | None) -> None:
    if (path is None) == (scene is None):
        raise InputError(
            "expected a path or a scene under each [[model]], got "
            f"{'neither' if path is None else 'both'} in one; give one of the two."
        )


@dataclass(frozen=True, kw_only=True)
class TrajectoryEntry:
    """A constant speed (mm/s, ≥ 0) and force (N, ≥ 0), or the CSV file of a recorded hand."""

    name: str
    speed_mm_s: float | None = None
    force_n: float | None = None
    file: Path | None = None

    def __post_init__(self) -> None:
        check_name("name of a trajectory", self.name)
        where = f"the trajectory {shown(self.name)}"
        _check_given((n for n, value in vars(self).items() if value is not None), where=where)
        if self.file is None:
            check_number(f"speed_mm_s in {where}", self.speed_mm_s, high=HIGHEST_SPEED_MM_S)
            check_number(f"force_n in {where}", self.force_n, high=HIGHEST_FORCE_N)

    @staticmethod
    def constant(speed_mm_s: float, force_n: float) -> TrajectoryEntry:
        """A constant speed and force, named after them."""
        check_number("speed_mm_s", speed_mm_s, high=HIGHEST_SPEED_MM_S)
        check_number("force_n", force_n, high=HIGHEST_FORCE_N)
        name = f"{speed_mm_s:g}mms_{force_n:g}N"
        return TrajectoryEntry(name=name, speed_mm_s=float(speed_mm_s), force_n=float(force_n))


def _check_given(given: Iterable[str], *, where: str) -> None:
    """Refuse a trajectory with anything but a speed and a force, or a file."""
    values = [name for name in given if name != "name"]
    if set(values) not in ({"speed_mm_s", "force_n"}, {"file"}):
        raise InputError(
            f"expected speed_mm_s and force_n, or a file, in {where}, got "
            f"{', '.join(values) or 'none of them'}; give the two numbers or the file."
        )


@dataclass(frozen=True, kw_only=True)
class Level:
    """How loud a set is, and what a full-scale 24-bit sample stands for.

    Parameters
    ----------
    mode : {"as modelled", "rms", "loudness"}
        The model's own level in g; every stimulus at `rms_db`; or every stimulus at one sensation
        level (`modeling.perception.sensation_level`).
    rms_db : float, optional
        dB re 1 g, −200 … 200; needed with "rms" and refused elsewhere.
    threshold : str or Path
        With "loudness": name of a shipped threshold, or a TSV.
    sensation_level_db : float, optional
        With "loudness": dB above threshold, −200 … 200; the set's median where None.
    full_scale_g : float, optional
        > 0; needed with the sample format "pcm24" and refused elsewhere (`Recipe` sees to it).

    Raises
    ------
    InputError
        For an unknown mode, values out of range, or one that the mode makes no use of.
    """

    mode: LevelMode = "as modelled"
    rms_db: float | None = None
    threshold: str | Path | None = None
    sensation_level_db: float | None = None
    full_scale_g: float | None = None

    def __post_init__(self) -> None:
        check_choice("mode under [level]", self.mode, get_args(LevelMode))
        uses = {"rms": ("rms_db",), "loudness": ("threshold", "sensation_level_db")}
        for mode, names in uses.items():
            for name in names:
                if self.mode != mode and getattr(self, name) is not None:
                    raise InputError(
                        f'expected {name} only with mode = "{mode}" under [level], got it with '
                        f'"{self.mode}"; remove it or change the mode.'
                    )
        if self.mode == "rms" or self.rms_db is not None:
            check_number("rms_db", self.rms_db, low=LEVELS_DB[0], high=LEVELS_DB[1])
        if self.sensation_level_db is not None:
            low, high = LEVELS_DB
            check_number("sensation_level_db", self.sensation_level_db, low=low, high=high)
        if self.full_scale_g is not None:
            low, high = FULL_SCALES_G
            check_number("full_scale_g", self.full_scale_g, low=low, high=high)
        if self.mode == "loudness" and self.threshold is None:
            object.__setattr__(self, "threshold", "codec")


@dataclass(frozen=True, kw_only=True)
class Recipe:
    """Everything that a stimulus set follows from, to the bit; see this module's text.

    Parameters
    ----------
    name : str
    models : tuple of ModelEntry
        At least one.
    trajectories : tuple of TrajectoryEntry
        At least one; different names.
    rates_hz : tuple of int
        Whole numbers up to 768 000, all different; each at least the models' rate.
    format : {"float32", "pcm24"}
        Samples in g, or 24-bit shares of `level.full_scale_g`.
    seeds : tuple of int
        0 … 2⁶³ − 1, all different.
    noise : {"independent", "frozen"}
        Whether every texture, model and trajectory has a noise of its own, or the models of one
        texture share it on each trajectory, so that nothing but the model differs between them.
        Shared noise makes two stimuli alike sample by sample, a cue that no two strokes over a
        surface offer; hence not the default.
    duration_s : float
        Of constant trajectories: one sample to an hour.
    settling_s : float
        0 … 60; how long the first condition is held before the start, while the filters settle
        (a band of B Hz takes about 1/B s).
    level : Level
    vibrator : Path, optional
        File of a vibrator (`tactileq vibrator`) that is to play the set: each file is the drive
        whose vibration is the one meant.

    Raises
    ------
    InputError
        Naming the first value that is out of range, doubled or missing.
    """

    name: str
    models: tuple[ModelEntry, ...]
    trajectories: tuple[TrajectoryEntry, ...]
    rates_hz: tuple[int, ...] = (48_000,)
    format: SampleFormat = "float32"
    seeds: tuple[int, ...] = (0,)
    noise: Noise = "independent"
    duration_s: float = 1.0
    settling_s: float = 0.5
    level: Level = field(default_factory=Level)
    vibrator: Path | None = None

    def __post_init__(self) -> None:
        check_name("name of the set", self.name)
        self._check_lists()
        check_choice("format", self.format, get_args(SampleFormat))
        check_choice("noise", self.noise, get_args(Noise))
        shortest = 1 / min(self.rates_hz)
        check_number("duration_s", self.duration_s, low=shortest, high=LONGEST_S)
        check_number("settling_s", self.settling_s, high=LONGEST_SETTLING_S)
        if (self.format == "pcm24") != (self.level.full_scale_g is not None):
            raise InputError(
                'expected full_scale_g under [level] with format = "pcm24" and only there, got '
                f'full_scale_g = {self.level.full_scale_g} with "{self.format}"; a 24-bit sample '
                "is a share of it, a float sample is g."
            )

    def _check_lists(self) -> None:
        names = [entry.name for entry in self.trajectories]
        lists = {"rate_hz": self.rates_hz, "seed": self.seeds, "trajectory": names}
        for what, values in {**lists, "model": self.models}.items():
            if not values:
                raise InputError(f"expected at least one {what} in the recipe, got none; add one.")
            doubled = [value for value in values if list(values).count(value) > 1]
            if doubled:
                raise InputError(
                    f"expected each {what} once in the recipe, got {_shown(doubled[0])} twice; "
                    "remove or rename one."
                )
        for rate_hz in self.rates_hz:
            check_whole("rate_hz", rate_hz, low=1, high=HIGHEST_RATE_HZ)
        for seed in self.seeds:
            check_whole("seed", seed, low=0, high=HIGHEST_SEED)

    @staticmethod
    def load(path: str | Path) -> Recipe:
        """Read a recipe (TOML); its paths are relative to the file.

        Raises
        ------
        InputError
            If the file is missing, no TOML or of another version, has unknown or missing keys, or
            values out of range. The files that it names are read later, by
            `sources.load_sources`, but for a scene without a label, whose name is one.
        """
        file = Path(path)
        values = read_toml(file, "a recipe")
        try:
            return _recipe_from(values, file.parent)
        except InputError as error:
            raise InputError(f"{file}: {error}") from None

    def files(self) -> list[Path]:
        """Every file or folder that the recipe names."""
        named: list[Path | str | None] = [entry.place for entry in self.models]
        named += [entry.file for entry in self.trajectories]
        named += [self.level.threshold, self.vibrator]
        return [path for path in named if isinstance(path, Path)]

    def to_toml(self) -> str:
        """The recipe as text with every key that applies; `load` makes it again."""
        settings = {
            "name": self.name,
            "rate_hz": self.rates_hz,
            "format": self.format,
            "seeds": self.seeds,
            "noise": self.noise,
            "duration_s": self.duration_s,
            "settling_s": self.settling_s,
            "vibrator": self.vibrator,
        }
        parts = [f"version = {VERSION}\n", _section("[set]", settings)]
        parts.append(_section("[level]", vars(self.level)))
        parts += [_section("[[model]]", vars(entry)) for entry in self.models]
        parts += [_section("[[trajectory]]", vars(entry)) for entry in self.trajectories]
        return "\n".join(parts)


def _recipe_from(values: Mapping[str, Any], folder: Path) -> Recipe:
    check_keys(values, ("version", *_SECTIONS), where="a recipe")
    check_version(values, VERSION, what="recipe")
    settings = toml_section(values, "set", _SECTIONS["set"])
    level = toml_section(values, "level", _SECTIONS["level"])
    if "name" not in settings:
        raise InputError("expected a name under [set], got none; name the set.")
    if "rate_hz" in settings:
        settings["rates_hz"] = _listed("rate_hz", settings.pop("rate_hz"))
    if "seeds" in settings:
        settings["seeds"] = _listed("seeds", settings["seeds"])
    if "vibrator" in settings:
        settings["vibrator"] = folder / as_text(settings["vibrator"], "vibrator under [set]")
    if Path(as_text(level.get("threshold", ""), "threshold")).suffix:
        level["threshold"] = folder / level["threshold"]
    return Recipe(
        models=tuple(_model_entry(entry, folder) for entry in _tables(values, "model")),
        trajectories=tuple(
            _trajectory_entry(entry, folder) for entry in _tables(values, "trajectory")
        ),
        level=Level(**level),
        **settings,
    )


def _model_entry(values: dict[str, Any], folder: Path) -> ModelEntry:
    path, scene = (
        folder / as_text(values[name], f"{name} under [[model]]") if name in values else None
        for name in ("path", "scene")
    )
    _check_one_place(path, scene)
    if "label" in values:
        return ModelEntry(path, values["label"], scene)
    if path is not None:
        return model_entry(path)
    assert scene is not None  # one of the two is given
    return ModelEntry(None, scene_name(scene), scene)


def model_entry(path: Path) -> ModelEntry:
    """A model file or a folder of them, labelled by the name of the folder."""
    place = Path(os.path.realpath(path))  # not resolve(), which raises for links in a circle
    return ModelEntry(path, place.name if os.path.isdir(place) else place.parent.name)


def _trajectory_entry(values: dict[str, Any], folder: Path) -> TrajectoryEntry:
    if "file" in values:
        file = folder / as_text(values["file"], "file under [[trajectory]]")
        return TrajectoryEntry(**{"name": file.stem, **values, "file": file})
    named = f"the trajectory {shown(values['name'])}" if "name" in values else "each [[trajectory]]"
    _check_given(values, where=named)
    entry = TrajectoryEntry.constant(values["speed_mm_s"], values["force_n"])
    return TrajectoryEntry(**{**vars(entry), "name": values.get("name", entry.name)})


def _tables(values: Mapping[str, Any], name: str) -> list[dict[str, Any]]:
    tables = values.get(name, [])
    if not isinstance(tables, list) or not all(isinstance(table, Mapping) for table in tables):
        raise InputError(
            f"expected tables [[{name}]], got {shown(tables)}; write [[{name}]] above the keys of "
            "each."
        )
    for table in tables:
        check_keys(table, _SECTIONS[name], where=f"[[{name}]]")
    return [dict(table) for table in tables]


def _listed(name: str, value: object) -> tuple[int, ...]:
    """One number or a list of them; 48000.0 is a whole number, too."""
    values = value if isinstance(value, list) else [value]
    return tuple(whole_or_as_it_is(v) for v in values)


def whole_or_as_it_is(value: Any) -> Any:
    """An int where a float is a whole number; anything else unchanged, for the check to refuse."""
    return int(value) if isinstance(value, float) and value.is_integer() else value


def _shown(value: object) -> str:
    return f"{value.place} ({value.label})" if isinstance(value, ModelEntry) else repr(value)


def _section(heading: str, values: Mapping[str, object]) -> str:
    lines = [f"{key} = {_toml(value)}" for key, value in values.items() if value is not None]
    return "\n".join([heading, *lines, ""])


def _toml(value: object) -> str:
    if isinstance(value, tuple):
        return f"[{', '.join(map(_toml, value))}]"
    if is_number(value):
        return repr(int(value) if is_whole(value) else float(value))
    text = value.as_posix() if isinstance(value, Path) else str(value)
    # A JSON string is a TOML string, too, but that TOML wants DEL escaped like all controls.
    return json.dumps(text, ensure_ascii=False).replace("\x7f", "\\u007f")
