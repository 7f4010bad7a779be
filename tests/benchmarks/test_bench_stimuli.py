"""How long a stimulus set takes, beside one thread and SciPy's resampling at the least length."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from pytest_benchmark.fixture import BenchmarkFixture

from tactileq.modeling import simplify
from tactileq.modeling.perception.thresholds import Threshold
from tactileq.stimuli.planted.textures import TEXTURES, planted_texture
from tactileq.stimuli.sets import rendering, writing
from tactileq.stimuli.sets.recipe import ModelEntry, Recipe, TrajectoryEntry
from tactileq.stimuli.sets.sources import load_sources

# A recorded hand ends when it ends, not after a round number of samples.
HANDS_S = (1.8702, 2.3174)


@pytest.fixture(scope="module")
def recipe(timed: bool, tmp_path_factory: pytest.TempPathFactory) -> Recipe:
    """7 textures, full and simplified, on four strokes at three rates (untimed: one texture)."""
    folder = tmp_path_factory.mktemp("models")
    for name in list(TEXTURES) if timed else list(TEXTURES)[:1]:
        model = planted_texture(name)
        model.save(folder / f"full/{name}.json")
        simplify(model, Threshold.named("codec"), criterion="paper-fft").model.save(
            folder / f"simplified/{name}.json"
        )
    strokes = [TrajectoryEntry.constant(speed, 1.0) for speed in (100.0, 250.0)]
    for number, duration_s in enumerate(HANDS_S):
        path = folder / f"{number}.csv"
        path.write_text(f"time_s,speed_mm_s,force_n\n0,50,1\n{duration_s},300,2\n")
        strokes.append(TrajectoryEntry(name=f"hand {number}", file=path))
    return Recipe(
        name="bench",
        models=tuple(ModelEntry(folder / label, label) for label in ("full", "simplified")),
        trajectories=tuple(strokes),
        rates_hz=(5000, 44_100, 48_000),
    )


def all_cores(patch: pytest.MonkeyPatch) -> None:
    """As it is."""


def one_thread_only(patch: pytest.MonkeyPatch) -> None:
    patch.setattr(writing, "thread_count", lambda _: 1)


def as_scipy_resamples(patch: pytest.MonkeyPatch) -> None:
    """Over the shortest length that the ratio of the rates divides, one after the other."""
    one_thread_only(patch)
    patch.setattr(rendering, "_fast_length", int)


WAYS = {
    "all cores": all_cores,
    "one thread": one_thread_only,
    "one thread, as SciPy resamples": as_scipy_resamples,
}


@pytest.mark.benchmark(group="a stimulus set, 168 files")
@pytest.mark.parametrize("way", WAYS)
def test_stimulus_set(
    benchmark: BenchmarkFixture,
    recipe: Recipe,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    way: str,
) -> None:
    WAYS[way](monkeypatch)
    benchmark.extra_info["what"] = way
    if WAYS[way] is as_scipy_resamples:
        benchmark.extra_info["rival"] = True
    sources = load_sources(recipe)

    stimuli = benchmark.pedantic(
        writing.write_set, args=(tmp_path / "set", recipe), kwargs={"sources": sources}, rounds=7
    )
    assert len(stimuli) == len(sources.models) * 4 * 3
    levels = np.array([stimulus.level_db for stimulus in stimuli]).reshape(-1, 3)
    assert np.ptp(levels, axis=1).max() < 0.05
