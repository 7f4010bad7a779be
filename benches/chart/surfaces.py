"""Textures for the chart: what methods are fitted to, and what they are judged by."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from time import process_time
from typing import Literal

import numpy as np
from numpy.typing import ArrayLike

from tactileq.analysis.textures.between import Measured, Truth, chessboard, halfway
from tactileq.benches.rendering.accuracy import stroke
from tactileq.modeling import InputError, RecordingSet
from tactileq.modeling.arrays import Floats
from tactileq.modeling.errors import counted, shown
from tactileq.modeling.fitting.conditions import recording_spectra
from tactileq.modeling.hand import Hand
from tactileq.modeling.models.grid import Condition, grid_axes
from tactileq.modeling.models.loading import load_model, models_in
from tactileq.modeling.recordings.recording_set import load_usable, textures_in
from tactileq.rig.recording.importing.hatt import HattTexture
from tactileq.rig.recording.importing.hatt_reader import load_hatt
from tactileq.stimuli.planted.drawn import draw_surface
from tactileq.stimuli.planted.textures import (
    FORCES_N,
    RECORDER_RATE_HZ,
    SPEEDS_MM_S,
    TEXTURES,
    PlantedSurface,
    planted_texture,
    record_texture,
)

Kind = Literal["drawn", "planted", "toolkit", "recorded"]
SURFACE_KINDS: dict[Kind, str] = {
    "drawn": "surfaces drawn from the statistics of 100 real ones (simulated)",
    "planted": "planted textures (simulated)",
    "toolkit": "models of the Penn Haptic Texture Toolkit (simulated recordings)",
    "recorded": "recordings, conditions held out",
}
_ONE_OF: dict[Kind, str] = {
    "drawn": "surface drawn from the statistics of 100 real ones (simulated)",
    "planted": "planted texture (simulated)",
    "toolkit": "model of the Penn Haptic Texture Toolkit (simulated recordings)",
    "recorded": "recording, conditions held out",
}
FIRST_SURFACE = 1000  # surfaces that no constant of the estimator was chosen by
RECORD_S = 1.0


def counted_kind(count: int, kind: Kind) -> str:
    """A number of surfaces of a kind: `1 planted texture (simulated)`."""
    return counted(count, _ONE_OF[kind], SURFACE_KINDS[kind])


# A stroke over half of which filters are judged; it starts from rest, where no slope is known.
STROKE_S, JUDGED_FROM_S = 0.75, 0.25
PRESSING_N = 1.0
PLACES = 24


@dataclass(frozen=True)
class Origin:
    """Where a texture comes from; small, so that it can be sent to another process.

    Parameters
    ----------
    kind : {"drawn", "planted", "toolkit", "recorded"}
    name : str
        Of the surface; of recordings the texture's.
    seed : int
        Of what is simulated: for drawn surfaces also which one it is.
    path : Path, optional
        The toolkit's file, or the folder of recordings.
    fold : int
        Which half of the recorded conditions is held out, 0 or 1.
    models : tuple of (str, Path)
        Models that were made elsewhere, with their names; for recordings.
    """

    kind: Kind
    name: str
    seed: int = 0
    path: Path | None = None
    fold: int = 1
    models: tuple[tuple[str, Path], ...] = ()

    @property
    def simulated(self) -> bool:
        return self.kind != "recorded"


@dataclass(frozen=True, eq=False)
class Material:
    """One texture, ready to be fitted and judged.

    Parameters
    ----------
    measured : sequence of (Recording, Spectrum)
        What methods are fitted to.
    truth : Truth or None
        None for recordings, where what was held out stands for it.
    at, between : list of (speed, force)
        Where they are judged: recorded, and not recorded (half-way, or held out).
    hidden : sequence of (Recording, Spectrum)
        What was held out.
    rate_hz : float
        Of the spectra.
    prepare_s : float
        Processor time that the spectra took.
    warnings : tuple of str
        What could not be used.
    """

    measured: Measured
    truth: Truth | None
    at: list[Condition]
    between: list[Condition]
    hidden: Measured
    rate_hz: float
    prepare_s: float
    simulated: bool
    warnings: tuple[str, ...] = ()


@dataclass(frozen=True)
class _ToolkitTruth:
    """A toolkit's filters, blended as its own renderer does."""

    texture: HattTexture

    def magnitude(self, frequency_hz: ArrayLike, *, speed_mm_s: float, force_n: float) -> Floats:
        return self.texture.filter(speed_mm_s, force_n).response(frequency_hz)


def load_material(source: Origin) -> Material:
    """The texture of a source.

    Raises
    ------
    InputError
        For files that cannot be read; for recordings too few to hold any out.
    """
    if source.kind == "recorded":
        return _recorded(source)
    return _material_with_truth(*_truth_and_records(source))


def _truth_and_records(source: Origin) -> tuple[Truth, RecordingSet]:
    if source.kind == "drawn":
        surface = draw_surface(source.seed)
        return surface, surface.record(duration_s=RECORD_S, seed=source.seed)
    if source.kind == "planted":
        planted = planted_texture(source.name, rate_hz=RECORDER_RATE_HZ)
        records = record_texture(planted, duration_s=RECORD_S, seed=source.seed)
        return PlantedSurface(source.name), records
    assert source.path is not None, "a toolkit's texture is read from its file"
    toolkit = load_hatt(source.path)
    records = toolkit.recordings(
        SPEEDS_MM_S.tolist(), FORCES_N.tolist(), duration_s=RECORD_S, seed=source.seed
    )
    return _ToolkitTruth(toolkit), records


def _material_with_truth(truth: Truth, records: RecordingSet) -> Material:
    start = process_time()
    measured = recording_spectra(records)
    prepare_s = process_time() - start
    at = sorted({recording.condition for recording, _ in measured})
    between = halfway(*grid_axes(at))
    if isinstance(truth, _ToolkitTruth):
        between = truth.texture.conditions_inside(between)
    return Material(measured, truth, at, between, [], measured[0][1].rate_hz, prepare_s, True)


def _recorded(source: Origin) -> Material:
    assert source.path is not None, "recordings are read from a folder"
    records, unusable = load_usable(source.path, texture=source.name)
    start = process_time()
    measured = recording_spectra(records)
    prepare_s = process_time() - start
    out = chessboard({recording.condition for recording, _ in measured}, colour=source.fold)
    kept = [pair for pair in measured if pair[0].condition not in out]
    hidden = [pair for pair in measured if pair[0].condition in out]
    if not out or len({recording.condition for recording, _ in kept}) < 4:
        speeds, forces = grid_axes({recording.condition for recording, _ in measured})
        raise InputError(
            f"{source.name}: expected recordings at 3 speeds × 3 forces or more, so that some can "
            f"be held out, got {len(speeds)} × {len(forces)}; record more conditions."
        )
    return Material(
        kept,
        None,
        sorted({recording.condition for recording, _ in kept}),
        sorted(out),
        hidden,
        measured[0][1].rate_hz,
        prepare_s,
        any(recording.simulated for recording, _ in measured),
        unusable,
    )


@dataclass(frozen=True, eq=False)
class Stroke:
    """A hand to and fro, and at which of its samples filters are judged."""

    hand: Hand
    places: list[int]


def judged_stroke(rate_hz: float) -> Stroke:
    """2 Hz at up to 300 mm/s, pressing with 1 … 3 N; judged where it is on the usual grid."""
    hand = stroke(rate_hz, duration_s=STROKE_S, pressing_n=PRESSING_N)
    on_grid = np.abs(hand.speed_mm_s) >= SPEEDS_MM_S[0]
    on_grid[: round(JUDGED_FROM_S * rate_hz)] = False
    places = np.flatnonzero(on_grid)
    chosen = places[np.linspace(0, places.size - 1, PLACES).round().astype(int)]
    return Stroke(hand, chosen.tolist())


@dataclass(frozen=True)
class Simulated:
    """How many surfaces are drawn, and which planted textures are recorded."""

    drawn: int
    planted: tuple[str, ...]


USUAL = Simulated(4, ("canvas",))
ALL_SURFACES = Simulated(40, TEXTURES)
FEW_SURFACES = Simulated(3, ())


def simulated_sources(which: Simulated) -> list[Origin]:
    """Drawn surfaces and planted textures, each with noise of its own."""
    numbers = range(FIRST_SURFACE, FIRST_SURFACE + which.drawn)
    drawn = [Origin("drawn", f"drawn {number}", number) for number in numbers]
    return drawn + [Origin("planted", name, seed) for seed, name in enumerate(which.planted)]


def recorded_sources(
    folders: Sequence[Path], models: Sequence[Path], *, both_halves: bool
) -> list[Origin]:
    """The textures of some folders, each with the models that were given for it.

    Raises
    ------
    InputError
        For a folder without recordings, and a texture that one of the models' folders lacks.
    """
    sources = []
    by_folder = {folder: _models_by_texture(folder) for folder in models}
    for path in folders:
        for name in textures_in(path):
            given = tuple(
                (f"models of {folder}", _model_of(name, found, folder))
                for folder, found in by_folder.items()
            )
            for fold in (1, 0) if both_halves else (1,):
                sources.append(Origin("recorded", name, path=path, fold=fold, models=given))
    return sources


def _models_by_texture(folder: Path) -> dict[str, Path]:
    return {load_model(path).texture: path for path in models_in(folder)[0]}


def _model_of(texture: str, models: Mapping[str, Path], folder: Path) -> Path:
    if texture not in models:
        raise InputError(
            f"expected a model of {shown(texture)} in {folder}, got models of "
            f"{', '.join(map(shown, models))}; model it, or leave its recordings out."
        )
    return models[texture]


def toolkit_sources(paths: Sequence[Path]) -> list[Origin]:
    """Textures of toolkit files; refused as `load_hatt` refuses them."""
    return [
        Origin("toolkit", load_hatt(path).material, seed, path) for seed, path in enumerate(paths)
    ]
