"""The planted textures and their recording in silico."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from itertools import combinations

import numpy as np
import pytest

from tactileq.modeling import InputError, TextureModel, fit_texture, similarity, spectrum
from tactileq.modeling.recordings.spectrum import Spectrum, smooth
from tactileq.stimuli.planted.textures import (
    CATALOGUE,
    RECORDER_RATE_HZ,
    TEXTURES,
    PlantedSurface,
    planted_texture,
    record_texture,
    sensed,
)
from tests.refusals import refused

STEP_G = 0.001907349  # the data sheet's g per LSB
SMALL = {"speeds_mm_s": np.array([100.0, 300.0]), "forces_n": np.array([1.0, 3.0])}


def test_names_and_25_layers() -> None:
    names = ("aluminum", "canvas", "leather", "MDF", "polyester", "PVC", "wall paper")
    assert names == TEXTURES
    models = [planted_texture(name) for name in names]
    assert sum(model.n_layers for model in models) == 25
    for name, model in zip(names, models, strict=True):
        assert (model.texture, model.estimator, model.unit) == (name, "planted", "g")
        assert model.simulated
        assert model.rate_hz == 5000.0
        assert not model.level_sd_db.any()  # known exactly


def test_grid_is_the_papers() -> None:
    model = planted_texture("MDF")
    assert model.speeds_mm_s.tolist() == [50, 100, 150, 200, 250, 300, 350]
    assert model.forces_n.tolist() == [0.5, 1, 1.5, 2, 2.5, 3, 3.5]


@pytest.mark.parametrize("name", TEXTURES)
def test_first_layer_is_a_spatial_wavelength_and_levels_grow(name: str) -> None:
    """f = v/λ for the main layer; louder with speed; levels of the size measured surfaces have."""
    model = planted_texture(name)
    wavelengths_mm = model.speeds_mm_s[:, None] / model.frequencies_hz[:, :, 0]
    assert np.ptp(wavelengths_mm) < 1e-9
    assert (np.diff(np.abs(model.gains), axis=0) > 0).all()
    assert (np.diff(model.frequencies_hz, axis=2) > 0).all()  # layers never cross
    assert (np.sign(model.gains) == np.sign(model.gains[0, 0])).all()  # one sign per layer
    grid = np.arange(10.0, 2490.0)
    peq = model.peq(200.0, 2.0)
    rms_g = np.sqrt(np.mean(peq.response(grid) ** 2))
    assert 0.02 < rms_g < 0.3


def test_layers_have_the_levels_that_were_planted() -> None:
    """At 200 mm/s and 2 N the catalogue's numbers, elsewhere its power laws."""
    for name, planted in CATALOGUE.items():
        here, there = (planted_texture(name).peq(v, f) for v, f in ((200.0, 2.0), (350.0, 0.5)))
        assert here.noise_gain == pytest.approx(planted.noise_g)
        for n, layer in enumerate(planted.layers):
            k = np.tan(np.pi * layer.bandwidth_hz / 5000)
            rms_g = here.gains[n] * np.sqrt(k / (1 + k))
            assert rms_g == pytest.approx(layer.sign * layer.rms_g)
            assert here.frequencies_hz[n] == pytest.approx(layer.frequency_hz)
            assert here.bandwidths_hz[n] == there.bandwidths_hz[n] == layer.bandwidth_hz
            growth = 1.75**layer.growth_speed * 0.25**layer.growth_force
            assert there.gains[n] / here.gains[n] == pytest.approx(growth)
            moved = layer.frequency_hz * 1.75**layer.speed_law
            assert there.frequencies_hz[n] == pytest.approx(moved)


def test_canvas_and_polyester_are_the_most_alike() -> None:
    """The pair that people confused has the smallest log-spectral distance of all 21 pairs.

    Of the GFC30 responses, mean over the grid's corners and middle speed; level counts.
    """
    grid = np.arange(10.0, 2450.0)
    conditions = [(v, f) for v in (50.0, 200.0, 350.0) for f in (0.5, 3.5)]
    models = {name: planted_texture(name) for name in TEXTURES}

    def response(model: TextureModel, condition: tuple[float, float]) -> np.ndarray:
        return smooth(model.peq(*condition).response(grid), 30.0, step_hz=1.0)

    def mean_of(measure: Callable[..., float], a: str, b: str) -> float:
        pairs = [(response(models[a], c), response(models[b], c)) for c in conditions]
        return float(np.mean([measure(*pair) for pair in pairs]))

    distance_db = {
        pair: mean_of(similarity.log_spectral_distance_db, *pair)
        for pair in combinations(TEXTURES, 2)
    }
    assert min(distance_db, key=lambda pair: distance_db[pair]) == ("canvas", "polyester")
    assert distance_db["canvas", "polyester"] < 1.2
    assert mean_of(similarity.gfc, "canvas", "polyester") > 0.98


def test_unknown_textures_are_refused() -> None:
    with refused(InputError, expected=["aluminum", "wall paper"], got="'velvet'"):
        planted_texture("velvet")


@pytest.mark.parametrize("name", TEXTURES)
def test_truth_and_surface_agree_at_the_recorders_rate(name: str) -> None:
    """Defined where it is recorded: the same at all frequencies, up to the unit of the gains."""
    truth = planted_texture(name, rate_hz=RECORDER_RATE_HZ)
    grid = np.arange(10.0, 2500.0, 5.0)
    for speed, force in ((50.0, 0.5), (200.0, 2.0), (350.0, 3.5)):
        expected = PlantedSurface(name).magnitude(grid, speed_mm_s=speed, force_n=force)
        found = truth.peq(speed, force).response(grid) * np.sqrt(5000 / RECORDER_RATE_HZ)
        assert found == pytest.approx(expected, rel=1e-12)


@pytest.mark.parametrize("rate_hz", [5000.0, RECORDER_RATE_HZ])
def test_centres_widths_and_peaks_are_the_same_at_every_rate(rate_hz: float) -> None:
    """|H| is 1 at the centre and √½ at two places that lie one width apart."""
    truth = planted_texture("MDF", rate_hz=rate_hz).with_layers([2])
    peq = truth.peq(200.0, 2.0)
    grid = np.arange(800.0, 1000.0, 0.01)
    layer = np.abs(peq.complex_response(grid) - peq.noise_gain) / peq.gains[0]
    assert grid[layer.argmax()] == pytest.approx(900.0, abs=0.01)
    assert np.ptp(grid[layer > np.sqrt(0.5)]) == pytest.approx(150.0, abs=0.05)
    at_5_khz = planted_texture("MDF").peq(200.0, 2.0).gains[2]
    assert peq.gains[0] * np.sqrt(5000 / rate_hz) == pytest.approx(at_5_khz)


def test_recording_is_complete_and_marked_simulated() -> None:
    truth = planted_texture("MDF", **SMALL, rate_hz=RECORDER_RATE_HZ)
    recordings = record_texture(truth, duration_s=0.1, seed=3).recordings
    assert [r.condition for r in recordings] == [(100, 1), (100, 3), (300, 1), (300, 3)]
    for r in recordings:
        assert (r.texture, r.unit, r.repeat, r.rate_hz) == ("MDF", "g", 1, 22704.0)
        assert r.simulated
        assert r.samples.size == 2270


def test_recording_is_reproducible_and_seeded() -> None:
    def record(name: str, seed: int) -> list[np.ndarray]:
        truth = planted_texture(name, **SMALL)
        return [r.samples for r in record_texture(truth, duration_s=0.05, seed=seed).recordings]

    for first, second in zip(record("MDF", 1), record("MDF", 1), strict=True):
        assert np.array_equal(first, second)
    one, other = record("MDF", 1), record("MDF", 2)
    assert not any(np.array_equal(a, b) for a, b in zip(one, other, strict=True))
    for a, b in combinations([*one, *other, *record("PVC", 1)], 2):
        assert abs(np.corrcoef(a, b)[0, 1]) < 0.6  # no two share their noise


def test_samples_are_whole_sensor_steps() -> None:
    truth = planted_texture("aluminum", **SMALL)
    samples = record_texture(truth, duration_s=0.05).recordings[0].samples
    steps = samples / STEP_G
    assert steps == pytest.approx(np.rint(steps), abs=1e-4)
    assert np.unique(np.rint(steps)).size > 20


def test_sensor_rounds_and_clips() -> None:
    reported = sensed(np.array([0.0, 0.4 * STEP_G, 0.6 * STEP_G, -1.2 * STEP_G, 80.0, -1e9]))
    assert reported[:4] == pytest.approx([0, 0, STEP_G, -STEP_G], abs=1e-8)
    assert reported[4] == pytest.approx(50.0, abs=STEP_G)
    assert reported[5] == pytest.approx(-50.0, abs=STEP_G)
    assert np.abs(sensed(np.linspace(-0.1, 0.1, 1001)) - np.linspace(-0.1, 0.1, 1001)).max() < (
        0.5 * STEP_G + 1e-8
    )


def test_loud_recordings_clip_and_say_so() -> None:
    quiet = planted_texture("MDF", **SMALL)
    loud = TextureModel(
        **{
            **{name: getattr(quiet, name) for name in quiet.__dataclass_fields__},
            "gains": quiet.gains * 3000,
        }
    )
    assert record_texture(loud, duration_s=0.1).recordings[-1].clipped_share > 0.02
    assert record_texture(quiet, duration_s=0.1).recordings[-1].clipped_share == 0


def test_recordings_have_the_truths_spectrum() -> None:
    """22.7 kHz record → 5 kHz spectrum: the response, level and shape, in 20 records."""
    truth = planted_texture("canvas", **SMALL, rate_hz=RECORDER_RATE_HZ)
    recordings = [
        r
        for seed in range(5)
        for r in record_texture(truth, duration_s=1.0, seed=seed).recordings
        if r.condition == (300.0, 3.0)
    ]
    found = np.mean([spectrum(r).magnitude for r in recordings], axis=0)
    surface = PlantedSurface("canvas")
    expected = surface.magnitude(np.arange(2501.0), speed_mm_s=300.0, force_n=3.0)
    bands = [(60, 100), (200, 300), (340, 440), (700, 860), (1000, 1500), (1500, 2450)]
    for low, high in bands:
        assert found[low:high].mean() == pytest.approx(expected[low:high].mean(), rel=0.1)
    rendered = planted_texture("canvas", **SMALL).peq(300.0, 3.0)
    report = similarity.report(Spectrum(np.arange(2501.0), found, 5000.0, 5000), rendered)
    assert report.gfc30 > 0.99
    assert abs(report.rms_error_db - 10 * np.log10(expected_power_ratio(5))) < 0.5


def expected_power_ratio(records: int) -> float:
    """Averaged magnitudes scatter less: (4/π) over 1 + (4/π − 1)/n."""
    return 4 / np.pi / (1 + (4 / np.pi - 1) / records)


def test_slow_recorders_are_refused() -> None:
    with refused(InputError, expected=["frequency", "1…490 Hz", "1000 Hz"], got=869.343):
        planted_texture("MDF", **SMALL, rate_hz=1000.0)


def test_fit_of_a_planted_texture_finds_its_loud_layers() -> None:
    truth = planted_texture("canvas", **SMALL)
    model = fit_texture(record_texture(truth, duration_s=1.0, seed=7))
    assert model.simulated
    at_top = model.frequencies_hz[1, 1]
    for wanted in truth.frequencies_hz[1, 1]:
        assert np.abs(at_top - wanted).min() < 25


def test_two_textures_under_one_seed_share_no_noise() -> None:
    """Of one model under two names: with the same noise the records would be the same."""
    one = planted_texture("canvas", rate_hz=RECORDER_RATE_HZ)
    found = [
        record_texture(replace(one, texture=name), duration_s=0.2, seed=1).recordings[-1].samples
        for name in ("canvas", "linen")
    ]
    assert abs(np.corrcoef(found)[0, 1]) < 0.2
    assert np.std(found[0]) == pytest.approx(np.std(found[1]), rel=0.2)
