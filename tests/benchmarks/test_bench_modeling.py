"""How long modelling takes, beside its rivals."""

from __future__ import annotations

from functools import partial
from pathlib import Path

import numpy as np
import pytest
from joblib import Parallel, cpu_count, delayed
from pytest_benchmark.fixture import BenchmarkFixture
from scipy.signal import resample, resample_poly

from tactileq.analysis.spectra.findings import find_in
from tactileq.commands.models.many_textures import HowToModel, model_textures
from tactileq.modeling import (
    ESTIMATORS,
    Recording,
    RecordingSet,
    find_layers,
    fit_ar,
    fit_texture,
    regressed,
    spectrum,
)
from tactileq.modeling.fitting.autoregressive import fit_filter
from tactileq.modeling.recordings.spectrum import MODEL_RATE_HZ
from tactileq.stimuli.planted.textures import planted_texture

RECORDER_RATE_HZ = 22704.0
AR_ORDER = 20
TONE_HZ = 1000.0


@pytest.mark.benchmark(group="7 records of 1 s, spectra given")
@pytest.mark.parametrize("estimator", ESTIMATORS)
def test_fit_of_a_record(
    benchmark: BenchmarkFixture, records: list[Recording], estimator: str
) -> None:
    spectra = [spectrum(record) for record in records]
    benchmark.extra_info |= {"what": estimator}
    found = benchmark(lambda: [find_layers(s, estimator=estimator) for s in spectra])
    for layers, measured in zip(found, spectra, strict=True):
        peq = layers.peq(rate_hz=measured.rate_hz)
        assert np.isfinite(peq.response(measured.frequency_hz)).all()


@pytest.mark.benchmark(group="7 records of 1 s, spectra given")
def test_autoregressive_fit_of_a_record(
    benchmark: BenchmarkFixture, records: list[Recording]
) -> None:
    spectra = [spectrum(record) for record in records]
    benchmark.extra_info |= {"what": f"AR({AR_ORDER})", "rival": True}
    filters = benchmark(lambda: [fit_filter([s], order=AR_ORDER) for s in spectra])
    for fitted, measured in zip(filters, spectra, strict=True):
        assert np.isfinite(fitted.response(measured.frequency_hz)).all()


def fft_resampled(samples: np.ndarray) -> np.ndarray:
    return np.asarray(resample(samples, round(samples.size * MODEL_RATE_HZ / RECORDER_RATE_HZ)))


def polyphase_resampled(samples: np.ndarray) -> np.ndarray:
    # 5000 / 22704 in lowest terms.
    return np.asarray(resample_poly(samples, 625, 2838))


@pytest.mark.benchmark(group="resampling of a record")
@pytest.mark.parametrize("method", [fft_resampled, polyphase_resampled])
def test_resampling(benchmark: BenchmarkFixture, method) -> None:
    time_s = np.arange(round(RECORDER_RATE_HZ)) / RECORDER_RATE_HZ
    benchmark.extra_info["what"] = method.__name__
    if method is polyphase_resampled:
        benchmark.extra_info["rival"] = True
    samples = benchmark(method, np.sin(2 * np.pi * TONE_HZ * time_s))
    assert samples.size == MODEL_RATE_HZ
    inside = slice(500, -500)  # the polyphase filter starts and ends on zeros
    expected = np.sin(2 * np.pi * TONE_HZ * np.arange(samples.size) / MODEL_RATE_HZ)
    assert samples[inside] == pytest.approx(expected[inside], abs=0.01)


@pytest.mark.benchmark(group="one texture, 49 records, as recorded")
@pytest.mark.parametrize("estimator", ESTIMATORS)
def test_fit_of_a_texture(
    benchmark: BenchmarkFixture, study: tuple[RecordingSet, ...], estimator: str
) -> None:
    benchmark.extra_info |= {"what": estimator}
    model = benchmark(lambda: fit_texture(study[0], estimator=estimator))
    assert model.gains.shape[0] * model.gains.shape[1] == len(study[0])


@pytest.mark.benchmark(group="one texture, 49 records, as recorded")
def test_autoregressive_fit_of_a_texture(
    benchmark: BenchmarkFixture, study: tuple[RecordingSet, ...]
) -> None:
    benchmark.extra_info |= {"what": f"AR({AR_ORDER})", "rival": True}
    model = benchmark(lambda: fit_ar(study[0], order=AR_ORDER))
    assert model.gains.size == len(study[0])


def resampling_and_one_paper_fit(study: tuple[RecordingSet, ...]) -> int:
    """What a study's modelling is compared with: both for each record, one after the other."""
    return sum(
        find_layers(spectrum(record), estimator="paper").gains.size > 0
        for recordings in study
        for record in recordings
    )


@pytest.mark.benchmark(group="whole study, 343 records")
def test_study_by_resampling_and_one_paper_fit_each(
    benchmark: BenchmarkFixture, study: tuple[RecordingSet, ...]
) -> None:
    benchmark.extra_info |= {"what": "343 × (resampling + one paper fit)", "rival": True}
    count = benchmark.pedantic(resampling_and_one_paper_fit, args=(study,), rounds=3)
    assert count == sum(map(len, study))


@pytest.mark.benchmark(group="whole study, 343 records")
@pytest.mark.parametrize("estimator", ESTIMATORS)
def test_models_of_a_study(
    benchmark: BenchmarkFixture, study: tuple[RecordingSet, ...], estimator: str
) -> None:
    benchmark.extra_info |= {"what": f"fit_texture, {estimator}"}
    models = benchmark.pedantic(
        lambda: [fit_texture(recordings, estimator=estimator) for recordings in study], rounds=3
    )
    assert [model.texture for model in models] == [recordings.texture for recordings in study]


@pytest.mark.benchmark(group="whole study, 343 records")
@pytest.mark.parametrize("estimator", ESTIMATORS)
def test_findings_of_a_study_on_all_cores(
    benchmark: BenchmarkFixture, study: tuple[RecordingSet, ...], estimator: str
) -> None:
    """What the command computes: each texture's model, and how well it fits its recordings."""
    benchmark.extra_info |= {"what": f"models and their fit on all cores, {estimator}"}
    find = delayed(partial(find_in, estimator=estimator))
    with Parallel(n_jobs=min(cpu_count(), len(study))) as parallel:
        findings = benchmark.pedantic(lambda: parallel(map(find, study)), rounds=3, warmup_rounds=1)
    for found, recordings in zip(findings, study, strict=True):
        assert found.model is not None
        assert len(found.measured) == len(recordings)


@pytest.mark.benchmark(group="whole study, 343 records")
def test_command_on_a_study(
    benchmark: BenchmarkFixture, study: tuple[RecordingSet, ...], tmp_path: Path
) -> None:
    """From files to files: reading, fitting, and tables."""
    for number, recordings in enumerate(study):
        recordings.save(tmp_path / "recordings" / str(number))
    benchmark.extra_info |= {"what": "tactileq model, from files to files, all cores"}
    options = {"how": HowToModel(), "jobs": None}
    benchmark.pedantic(
        model_textures, args=([tmp_path / "recordings"], tmp_path / "out"), kwargs=options
    )
    assert len(list((tmp_path / "out").glob("*_layers.tsv"))) == len(study)


@pytest.mark.benchmark(group="parameters at 20 000 points of a stroke")
@pytest.mark.parametrize("driven_by", ["grid", "conditions", "centroid"])
def test_parameters_of_a_stroke(benchmark: BenchmarkFixture, driven_by: str) -> None:
    """A model driven by its grid, and by regressions instead."""
    planted = planted_texture("canvas")
    model = planted if driven_by == "grid" else regressed(planted, by=driven_by)
    time_s = np.arange(20_000) / MODEL_RATE_HZ
    speed = 400 * np.abs(np.sin(2 * np.pi * time_s))
    benchmark.extra_info |= {"what": f"by {driven_by}"}
    if driven_by == "grid":
        benchmark.extra_info["rival"] = True
    found = benchmark(model.parameters, speed, np.full(speed.size, 1.5))
    assert found.gains.shape == (20_000, 4)
    assert np.isfinite(found.gains).all()
