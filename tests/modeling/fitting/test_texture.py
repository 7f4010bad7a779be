"""From recordings to the model over the grid: tracking, holes, refusals, recovery."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest
from scipy.ndimage import gaussian_filter1d

from tactileq.modeling import (
    ESTIMATORS,
    PEQ,
    InputError,
    Recording,
    Renderer,
    TextureModel,
    fit_texture,
    missing_conditions,
)
from tactileq.modeling.fitting.conditions import recording_spectra, spectra_by_condition
from tactileq.modeling.fitting.texture import fit_spectra
from tactileq.modeling.models.grid import fill_grid
from tactileq.modeling.recordings.recording_set import RecordingSet
from tactileq.modeling.recordings.spectrum import mean_spectrum
from tests.refusals import refused

ModelMaker = Callable[..., TextureModel]
RecordingMaker = Callable[..., Recording]
LAYERS = [(150.0, 30.0, 0.5), (600.0, 60.0, 0.5), (1300.0, 100.0, 0.5)]


def record(
    model: TextureModel,
    *,
    duration_s: float = 1.0,
    seed: int = 0,
    without: tuple[tuple[float, float], ...] = (),
) -> list[Recording]:
    """Renderings of every condition at the model's rate, settled for 0.2 s."""
    recordings = []
    conditions = [(v, f) for v in model.speeds_mm_s for f in model.forces_n]
    for stream, (v, f) in enumerate(conditions):
        if (v, f) in without:
            continue
        renderer = Renderer(model, seed=seed, stream=stream)
        renderer.render(v, f, samples=1000)
        samples = renderer.render(v, f, samples=round(duration_s * model.rate_hz))
        recordings.append(Recording(samples, model.rate_hz, v, f, "planted", simulated=True))
    return recordings


def test_well_separated_layers_are_recovered(make_model: ModelMaker) -> None:
    """Honest tolerances: 30 Hz smoothing widens the narrowest band by half and lowers its gain."""
    fits = [
        fit_texture(record(make_model(0.05, LAYERS), duration_s=4.0, seed=seed))
        for seed in range(2)
    ]
    for model in fits:
        assert model.n_layers == 3
        assert not model.inherited.any()
        assert not model.interpolated.any()
        assert np.abs(model.frequencies_hz - [150, 600, 1300]).max() < 15
        assert (np.abs(model.bandwidths_hz / [30, 60, 100] - 1) < [0.75, 0.35, 0.2]).all()
        assert (np.abs(model.gains / 0.5 - 1) < [0.35, 0.2, 0.15]).all()
        assert model.noise_gains == pytest.approx(0.05, rel=0.12)
    average = np.mean([model.frequencies_hz for model in fits], axis=(0, 1, 2))
    assert average == pytest.approx([150, 600, 1300], abs=8)
    # What the hand feels, the band's level, is right though width and gain trade places.
    level = [20 * np.log10(model.peq(100.0, 1.0).band_rms) for model in fits]
    k = np.tan(np.pi * np.array([30, 60, 100]) / 5000)
    assert np.mean(level, axis=0) == pytest.approx(20 * np.log10(0.5 * np.sqrt(k / (1 + k))), abs=1)


def scatterless(
    peq: PEQ, speed_mm_s: float, force_n: float, *, rng: np.random.Generator
) -> Recording:
    """1 s whose magnitude spectrum is the response itself, in every bin, with random phases."""
    frequency = np.arange(2501.0)
    phases = np.exp(2j * np.pi * rng.random(2501))
    samples = np.fft.irfft(phases * peq.response(frequency) * np.sqrt(np.pi * 5000) / 2, 5000)
    return Recording(samples, 5000.0, speed_mm_s, force_n, "planted", simulated=True)


def scatterless_grid(
    layers: Callable[[float, float], list[tuple[float, float, float]]],
) -> list[Recording]:
    """Such records at 3 speeds × 2 forces; `layers` gives (f, B, G) for speed and force."""
    rng = np.random.default_rng(0)
    recordings = []
    for v in (100.0, 200.0, 300.0):
        for f in (1.0, 3.0):
            frequency, bandwidth, gain = np.array(layers(v, f), dtype=float).reshape(-1, 3).T
            peq = PEQ(
                noise_gain=0.05,
                frequencies_hz=frequency,
                bandwidths_hz=bandwidth,
                gains=gain,
                rate_hz=5000.0,
            )
            recordings.append(scatterless(peq, v, f, rng=rng))
    return recordings


def test_layers_keep_their_names_while_they_move() -> None:
    """A layer at v/λ passes from 150 to 450 Hz below one that stays at 800 Hz."""
    recordings = scatterless_grid(lambda v, f: [(1.5 * v, 40, 0.5), (800, 60, 0.2 * f)])
    model = fit_texture(recordings, estimator="paper-consistent")
    assert model.n_layers == 2
    assert not model.inherited.any()
    assert model.frequencies_hz[:, :, 0] == pytest.approx(
        np.array([[150.0] * 2, [300.0] * 2, [450.0] * 2]), abs=4
    )
    # The upper one's skirts pull the smoothed maximum up by some Hz: that maximum is the answer.
    for i, v in enumerate(model.speeds_mm_s):
        for j, f in enumerate(model.forces_n):
            response = PEQ(
                noise_gain=0.05,
                frequencies_hz=[1.5 * v, 800],
                bandwidths_hz=[40, 60],
                gains=[0.5, 0.2 * f],
                rate_hz=5000.0,
            ).response(np.arange(2501.0))
            smoothed = gaussian_filter1d(response, 30.0, mode="reflect")
            highest = 700 + int(np.argmax(smoothed[700:900]))
            assert model.frequencies_hz[i, j, 1] == pytest.approx(highest, abs=1)
            assert model.frequencies_hz[i, j, 1] == pytest.approx(800, abs=10)
    assert model.gains[:, :, 1] == pytest.approx(np.array([[0.2, 0.6]] * 3), rel=0.08)


@pytest.mark.parametrize("estimator", ESTIMATORS)
def test_result_is_described(make_model: ModelMaker, estimator: str) -> None:
    model = fit_texture(record(make_model(0.05, LAYERS)), estimator=estimator)
    assert (model.texture, model.unit, model.estimator) == ("planted", "g", estimator)
    assert (model.simulated, model.rate_hz) == (True, 5000.0)
    assert model.speeds_mm_s.tolist() == [100.0, 300.0]
    assert model.forces_n.tolist() == [1.0, 3.0]
    if estimator != "joint":  # both readings of the paper keep all signs positive
        assert (model.gains > 0).all()
    # A third of a dB at a width of 50 Hz and 1 s, less for wider bands
    # (docs/method/estimation.md#level-deviations), more where a width has to be estimated as well.
    assert (model.level_sd_db > 0.1).all()
    assert (model.level_sd_db < 1.5).all()


def test_lost_peak_inherits_the_references_frequency() -> None:
    lost = {(100.0, 3.0), (200.0, 1.0)}

    def layers(v: float, f: float) -> list[tuple[float, float, float]]:
        first = (200 + v / 10, 50, 0.5)
        return [first] if (v, f) in lost else [first, (800 + v / 5 + f, 60, 0.5)]

    model = fit_texture(scatterless_grid(layers), estimator="paper-consistent")
    inherited = np.zeros((3, 2, 2), dtype=bool)
    inherited[0, 1, 1] = inherited[1, 0, 1] = True
    assert model.inherited.tolist() == inherited.tolist()
    upper = model.frequencies_hz[:, :, 1]
    assert upper[0, 1] == upper[1, 1]  # from the next faster at that force
    assert upper[1, 0] == upper[2, 0]
    assert upper[0, 0] < upper[1, 0]  # found again, so no longer inherited
    assert (model.gains[[0, 1], [1, 0], 1] < 0.03).all()  # B and G are fitted anew
    assert (model.gains[~inherited] > 0.4).all()


def test_layers_missing_in_the_lead_are_not_added_later() -> None:
    recordings = scatterless_grid(
        lambda v, f: [(200, 50, 0.5)] + ([] if (v, f) == (300.0, 3.0) else [(800, 60, 0.5)])
    )
    model = fit_texture(recordings, estimator="paper-consistent")
    assert model.n_layers == 1
    assert model.frequencies_hz[:, :, 0] == pytest.approx(200.0, abs=8)


def test_next_condition_leads_where_the_first_has_no_peaks() -> None:
    recordings = scatterless_grid(
        lambda v, f: [] if (v, f) == (300.0, 3.0) else [(200 + v / 10, 50, 0.5), (800, 60, 0.5)]
    )
    model = fit_texture(recordings, estimator="paper-consistent")
    assert model.n_layers == 2
    assert model.inherited[2, 1].all()
    assert not np.delete(model.inherited.reshape(6, 2), 5, axis=0).any()
    assert (model.frequencies_hz[2, 1] == model.frequencies_hz[1, 1]).all()


def test_no_layers_at_all() -> None:
    recordings = scatterless_grid(lambda v, f: [])
    model = fit_texture(recordings, estimator="paper-consistent")
    assert (model.n_layers, model.n_parameters) == (0, 1)
    assert model.noise_gains == pytest.approx(0.05, rel=0.01)
    # … also with a hole
    with_hole = fit_texture(recordings[:-1], estimator="paper-consistent")
    assert missing_conditions(with_hole) == [(300.0, 3.0)]
    assert with_hole.noise_gains == pytest.approx(0.05, rel=0.01)


def test_top_corner_may_be_missing(make_model: ModelMaker) -> None:
    model = fit_texture(record(make_model(0.05, LAYERS), without=((300.0, 3.0),)))
    assert model.n_layers == 3
    assert missing_conditions(model) == [(300.0, 3.0)]
    assert model.interpolated.tolist() == [[False, False], [False, True]]
    assert not model.inherited[1, 1].any()


def test_holes_are_named_marked_and_filled(make_model: ModelMaker) -> None:
    truth = make_model(0.05, LAYERS, speeds_mm_s=(100.0, 200.0, 300.0), forces_n=(1.0, 2.0, 3.0))
    holes = ((200.0, 2.0), (100.0, 3.0))
    model = fit_texture(record(truth, without=holes))
    assert sorted(missing_conditions(model)) == sorted(holes)
    assert model.interpolated.sum() == 2
    assert np.abs(model.frequencies_hz - [150, 600, 1300]).max() < 20
    others = model.noise_gains[~model.interpolated]
    assert others.min() <= model.noise_gains[1, 1] <= others.max()


@pytest.mark.parametrize("hole", [(v, f) for v in range(5) for f in range(4)])
def test_linear_truth_is_filled_exactly(hole: tuple[int, int]) -> None:
    grid = np.array([(100.0 * (v + 1), f + 0.5) for v in range(5) for f in range(4)])
    values = np.stack([3 + 0.2 * grid[:, 0] - 4 * grid[:, 1], -grid[:, 1]], axis=1)
    missing = np.zeros(20, dtype=bool)
    missing[hole[0] * 4 + hole[1]] = True
    rows = {tuple(c): v for c, v, hole_ in zip(grid, values, missing, strict=True) if not hole_}
    filled = fill_grid(rows, "planted")[0].reshape(20, -1)[missing][0]
    corner = hole[0] in (0, 4) and hole[1] in (0, 3)
    if not corner:
        assert filled == pytest.approx(values[missing][0], rel=1e-9)
    else:  # nothing beyond: the nearest neighbour's value
        steps = np.abs(grid[~missing] - grid[missing]) / [100.0, 1.0]
        neighbours = values[~missing][steps.sum(axis=1) == 1]
        assert any(filled == pytest.approx(row) for row in neighbours)


@pytest.mark.parametrize("limit", [0.1, 2250.0, 2450.0])
def test_filling_stays_within_the_legal_range(limit: float) -> None:
    grid = np.array([(50.0 * (v + 1), 0.5 * (f + 1)) for v in range(7) for f in range(7)])
    rng = np.random.default_rng(0)
    for _ in range(20):
        holes = rng.random(49) < 0.3
        filled, interpolated = fill_grid({tuple(c): [limit] for c in grid[~holes]}, "planted")
        assert (filled == limit).all()
        assert interpolated.sum() == holes.sum()


def test_recordings_on_a_line_are_refused(make_model: ModelMaker) -> None:
    without = ((100.0, 3.0), (300.0, 1.0))
    with refused(InputError, names="planted", expected="grid", got=[2, 4]):
        fit_texture(record(make_model(0.05, LAYERS), without=without))


@pytest.mark.parametrize("estimator", ["paper", "paper-consistent", "joint"])
def test_one_force_or_one_speed_suffices(make_model: ModelMaker, estimator: str) -> None:
    """A grid of 1 × n; what was recorded holds at every value of the other."""
    recordings = record(make_model(0.05, LAYERS))
    by_speed = fit_texture([r for r in recordings if r.force_n == 1.0], estimator=estimator)
    assert by_speed.noise_gains.shape == (2, 1)
    assert by_speed.n_layers == 3
    assert by_speed.frequencies_hz[0, 0] == pytest.approx([c for c, _, _ in LAYERS], rel=0.1)
    assert np.array_equal(by_speed.peq(150.0, 1.0).gains, by_speed.peq(150.0, 9.0).gains)
    by_force = fit_texture([r for r in recordings if r.speed_mm_s == 100.0], estimator=estimator)
    assert by_force.noise_gains.shape == (1, 2)
    one = [r for r in recordings if (r.speed_mm_s, r.force_n) == (100.0, 1.0)]
    assert fit_texture(one, estimator=estimator).noise_gains.shape == (1, 1)


def test_mixed_textures_and_units_are_refused(
    make_model: ModelMaker, make_recording: RecordingMaker
) -> None:
    recordings = record(make_model(0.05, LAYERS))
    with refused(InputError, expected="texture", got="planted, other"):
        fit_texture([*recordings, make_recording(texture="other")])
    with refused(InputError, names="planted", expected="unit", got=["arbitrary", "g"]):
        fit_texture([*recordings, make_recording(unit="arbitrary", speed_mm_s=50.0)])
    with refused(InputError, expected="recording", got="none"):
        fit_texture([])
    with refused(InputError, expected=["joint", "paper", "paper-consistent"], got="'magic'"):
        fit_texture(recordings, estimator="magic")


def test_contact_without_motion_is_refused(make_recording: RecordingMaker) -> None:
    with refused(InputError, expected=["speed", "force", 0], got=["planted", "0 mm/s", "1 N"]):
        fit_texture([make_recording(speed_mm_s=0.0)])
    with refused(InputError, expected=["speed", "force", 0], got="contact"):
        fit_texture([make_recording(force_n=0.0)])


def test_no_contact_recording_is_the_floor(make_recording: RecordingMaker) -> None:
    """Vibration of 0.4 under a sensor's noise of 0.3 counts as 0.4."""
    rng = np.random.default_rng(3)
    draws = rng.standard_normal((9, 20000))
    recordings = [
        make_recording(0.4 * draws[2 * n] + 0.3 * draws[2 * n + 1], speed_mm_s=v, force_n=f)
        for n, (v, f) in enumerate([(100.0, 1.0), (100.0, 2.0), (200.0, 1.0), (200.0, 2.0)])
    ]
    floor = make_recording(0.3 * draws[8], speed_mm_s=0.0, force_n=0.0)
    assert fit_texture(recordings).noise_gains == pytest.approx(0.5, rel=0.04)
    assert fit_texture([*recordings, floor]).noise_gains == pytest.approx(0.4, rel=0.06)


def test_repeats_are_averaged_per_condition(make_recording: RecordingMaker) -> None:
    rng = np.random.default_rng(3)
    recordings = [
        make_recording(level * rng.standard_normal(20000), repeat=repeat)
        for repeat, level in ((1, 0.2), (2, 0.6))
    ]
    spectra = spectra_by_condition(recording_spectra(RecordingSet(recordings)))
    assert list(spectra) == [(100.0, 1.0)]
    assert mean_spectrum(spectra[100.0, 1.0]).magnitude[100:].mean() == pytest.approx(0.4, rel=0.03)


def test_slow_data_give_a_model_at_their_rate(make_model: ModelMaker) -> None:
    truth = make_model(0.05, [(120.0, 30.0, 0.5)], rate_hz=1000.0)
    model = fit_texture(record(truth, duration_s=4.0))
    assert model.rate_hz == 1000.0
    assert model.frequencies_hz[:, :, 0] == pytest.approx(120.0, abs=12)


def test_lowest_rate_counts(make_recording: RecordingMaker) -> None:
    recordings = [make_recording(seed=1), make_recording(seed=2, rate_hz=1000.0, force_n=2.0)]
    spectra = recording_spectra(RecordingSet(recordings))
    assert {s.rate_hz for _, s in spectra} == {1000.0}


# --- a whole texture by `joint`


def drawn(peq: PEQ, n: int, *, rng: np.random.Generator) -> np.ndarray:
    """(n,) samples of one noise through a PEQ at 5 kHz, cut from a longer circle."""
    response = peq.complex_response(np.fft.rfftfreq(4 * n, 1 / 5000))
    return np.fft.irfft(response * np.fft.rfft(rng.standard_normal(4 * n)), 4 * n)[:n]


def test_repeats_tell_joint_more(make_model: ModelMaker) -> None:
    """Four records of a condition halve what they tell; means keep gains unbiased.

    What the neighbours tell of a level is not halved for its own records: so nearly half.
    """
    truth = make_model(0.05, LAYERS)
    once = record(truth, seed=0)
    often = [
        Recording(r.samples, r.rate_hz, r.speed_mm_s, r.force_n, "planted", repeat=k + 1)
        for k in range(4)
        for r in record(truth, seed=k)
    ]
    one, four = fit_texture(once), fit_texture(often)
    assert one.n_layers == four.n_layers == 3
    ratio = four.level_sd_db / one.level_sd_db
    assert 0.45 < np.median(ratio) < 0.6
    assert four.noise_gains == pytest.approx(0.05, rel=0.05)
    level_db = 20 * np.log10(four.gains * np.sqrt(four.bandwidths_hz))
    expected = [20 * np.log10(g * np.sqrt(b)) for _, b, g in LAYERS]
    assert (np.abs(level_db - expected) < 4 * four.level_sd_db).all()


def test_a_floor_above_the_noise_brings_no_layers(make_model: ModelMaker) -> None:
    """What its subtraction leaves would otherwise be a peak at the same place everywhere."""
    rng = np.random.default_rng(0)
    peq = make_model(0.02, [(200.0, 40.0, 1.0), (700.0, 60.0, 0.3)]).peq(100.0, 1.0)
    recordings = [
        Recording(drawn(peq, 5000, rng=rng) + 0.1 * rng.standard_normal(5000), 5000.0, v, f, "x")
        for v in (100.0, 200.0, 300.0)
        for f in (1.0, 2.0, 3.0)
    ]
    floor = Recording(0.1 * rng.standard_normal(5000), 5000.0, 0.0, 0.0, "x")
    model = fit_texture([*recordings, floor])
    assert model.n_layers == 2
    assert model.frequencies_hz == pytest.approx(np.broadcast_to([200.0, 700.0], (3, 3, 2)), abs=20)
    assert (model.noise_gains < 0.1).all()


def test_holes_of_a_joint_model_lie_between_their_neighbours(make_model: ModelMaker) -> None:
    truth = make_model(0.05, LAYERS, speeds_mm_s=(100.0, 200.0, 300.0), forces_n=(1.0, 2.0, 3.0))
    model = fit_texture(record(truth, without=((200.0, 2.0),)))
    assert missing_conditions(model) == [(200.0, 2.0)]
    assert model.n_layers == 3
    for name in ("frequencies_hz", "bandwidths_hz", "gains"):
        values = getattr(model, name)
        others = values[~model.interpolated]
        assert (values[1, 1] >= others.min(axis=0)).all()
        assert (values[1, 1] <= others.max(axis=0)).all()
    assert (np.sign(model.gains) == np.sign(model.gains[0, 0])).all()


def test_a_layer_beyond_the_nyquist_frequency_is_foretold_within_it() -> None:
    """8 cycles per mm are at 2.4 kHz at 300 mm/s, and would be at 2.8 kHz at 350 mm/s."""
    rng = np.random.default_rng(0)
    recordings = []
    for v in np.linspace(50.0, 350.0, 7):
        layers = [(200.0, 40.0, 0.3)] + ([(8 * v, 60.0, 0.3)] if v < 280 else [])
        frequency, bandwidth, gain = np.array(layers).T
        peq = PEQ(
            noise_gain=0.02,
            frequencies_hz=frequency,
            bandwidths_hz=bandwidth,
            gains=gain,
            rate_hz=5000.0,
        )
        for f in (1.0, 2.0, 3.0):
            recordings.append(Recording(drawn(peq, 5000, rng=rng), 5000.0, v, f, "x"))
    model = fit_texture(recordings)
    assert model.n_layers == 2
    assert model.frequencies_hz.max() <= 2450
    assert model.inherited[-1, :, 1].all()


# --- what is wrong with a record


def with_hum(recording: Recording) -> Recording:
    """The record with 50 and 150 Hz of the mains, louder than it is itself."""
    time = np.arange(recording.samples.size) / recording.rate_hz
    loud = np.sqrt(2) * recording.samples.std()
    hum = 3 * loud * np.sin(2 * np.pi * 50 * time + 1) + loud * np.sin(2 * np.pi * 150 * time)
    return replace(recording, samples=recording.samples + hum)


def test_hum_is_taken_out_told_of_and_kept_on_request(make_model: ModelMaker) -> None:
    clean = RecordingSet(record(make_model(0.05, LAYERS)))
    humming = RecordingSet([with_hum(r) for r in clean])
    measured = recording_spectra(humming)
    notes = [spectrum.notes for _, spectrum in measured]
    assert notes == [("mains hum at 50, 150 Hz removed",)] * 4
    kept = recording_spectra(humming, keep_hum=True)
    for recording, spectrum in kept:
        rms = np.std(recording.samples) / np.sqrt(1 + 9 + 1) * np.array([3, 1])
        words = [note.split() for note in spectrum.notes]
        assert [float(word[-2]) for word in words] == [50.0, 150.0]
        assert [float(word[3]) for word in words] == pytest.approx(rms, rel=0.05)
    model, without, with_it = fit_texture(humming), fit_texture(clean), fit_spectra(kept)
    assert model.n_layers == without.n_layers == 3
    assert 20 * np.log10(
        model.peq(200.0, 2.0).band_rms / without.peq(200.0, 2.0).band_rms
    ) == pytest.approx(0, abs=1.5)
    assert np.abs(with_it.frequencies_hz - 50).min(axis=-1).max() < 2


def test_a_record_that_drifts_or_changes_its_level_is_told_of(make_model: ModelMaker) -> None:
    """Played ever faster, by 30 % in all; and twice as loud half-way."""
    steady = record(make_model(0.05, LAYERS), duration_s=2.0)
    n = steady[0].samples.size // 2
    share = np.arange(n) / n
    at = (share + 0.3 * (share**2 - share) / 2) * n + n / 4
    faster = np.interp(at, np.arange(2 * n), steady[0].samples)
    louder = steady[1].samples * np.where(np.arange(2 * n) < n, 1.0, 2.0)
    changed = [
        replace(steady[0], samples=faster),
        replace(steady[1], samples=louder),
        *steady[2:],
    ]
    drifting, loud, *others = [s.notes for _, s in recording_spectra(RecordingSet(changed))]
    assert len(drifting) == len(loud) == 1
    assert "its frequencies drift by +" in drifting[0]
    assert "its level changes by 6." in loud[0]
    assert others == [(), ()]


@pytest.mark.parametrize("estimator", ESTIMATORS)
def test_a_silent_condition_is_interpolated(make_model: ModelMaker, estimator: str) -> None:
    """One that holds nothing but the sensor's floor."""
    recordings = record(make_model(0.05, LAYERS))
    floor = replace(recordings[0], samples=1e-4 * recordings[0].samples, force_n=0.0)
    silent = replace(recordings[1], samples=floor.samples)
    others = [recordings[0], *recordings[2:], floor]
    model = fit_texture([*others, silent], estimator=estimator)
    assert model.interpolated.tolist() == [[False, True], [False, False]]
    assert np.array_equal(model.gains, fit_texture(others, estimator=estimator).gains)
    with refused(InputError, names="planted", expected="vibration", got="silence"):
        fit_texture([silent, floor], estimator=estimator)


def test_hum_of_the_floor_takes_nothing_from_the_texture(make_recording: RecordingMaker) -> None:
    """A floor that hums as the records do: what lies beside the lines stays."""
    rng = np.random.default_rng(0)
    time = np.arange(5000) / 5000
    hum = 0.5 * np.cos(2 * np.pi * 50 * time) + 0.5 * np.cos(2 * np.pi * 150 * time)

    def set_with(added: np.ndarray | float) -> RecordingSet:
        labels = [(100.0, 1.0), (200.0, 1.0), (100.0, 2.0), (200.0, 2.0), (0.0, 0.0)]
        levels = [0.1, 0.1, 0.1, 0.1, 1e-3]
        return RecordingSet(
            Recording(level * noise + added, 5000.0, v, f, "oak")
            for (v, f), level, noise in zip(
                labels, levels, rng.standard_normal((5, 5000)), strict=True
            )
        )

    (_, clean), (_, hummed) = (recording_spectra(set_with(x))[0] for x in (0.0, hum))
    band = (clean.frequency_hz > 30) & (clean.frequency_hz < 90)
    level = [10 * np.log10(np.mean(s.magnitude[band] ** 2)) for s in (clean, hummed)]
    assert level[1] == pytest.approx(level[0], abs=2)
    assert (hummed.share[hummed.frequency_hz == 50] == 0).all()
    assert (hummed.share[hummed.frequency_hz == 70] > 0.9).all()


def test_hum_of_a_drifting_record_is_taken_out(make_model: ModelMaker) -> None:
    steady = record(make_model(0.05, LAYERS), duration_s=2.0)
    n = steady[0].samples.size // 2
    share = np.arange(n) / n
    at = (share + 0.3 * (share**2 - share) / 2) * n + n / 4
    hum = 0.5 * np.cos(2 * np.pi * 50 * np.arange(n) / 5000)
    faster = [np.interp(at, np.arange(2 * n), r.samples) for r in steady]
    clean, hummed = (
        recording_spectra(
            RecordingSet(replace(r, samples=x + added) for r, x in zip(steady, faster, strict=True))
        )
        for added in (0.0, hum)
    )
    for (_, without), (_, mended) in zip(clean, hummed, strict=True):
        assert "mains hum at 50 Hz removed" in mended.notes
        assert any("drift" in note for note in mended.notes)
        near = (np.abs(mended.frequency_hz - 50) < 10) & (mended.share > 0)
        left, noise = (np.sum(s.magnitude[near] ** 2) for s in (mended, without))
        assert left < 1.5 * noise


@pytest.mark.parametrize(("samples", "rate_hz"), [(64, 44_100.0), (100, 44_100.0)])
def test_records_too_short_for_a_spectrum_are_refused(
    make_recording: RecordingMaker, samples: int, rate_hz: float
) -> None:
    short = make_recording(np.random.default_rng(0).standard_normal(samples), rate_hz=rate_hz)
    with refused(
        InputError,
        names=["planted", "44100 Hz"],
        expected=[64, "5000 Hz"],
        got=int(samples * 5000 / rate_hz),
    ):
        recording_spectra(RecordingSet([short]))


@pytest.mark.parametrize(("samples", "rate_hz"), [(200, 45.0), (64, 48.0), (70, 5000.0)])
def test_records_that_are_slow_or_short_do_not_drift(
    make_recording: RecordingMaker, samples: int, rate_hz: float
) -> None:
    short = make_recording(np.random.default_rng(0).standard_normal(samples), rate_hz=rate_hz)
    [(_, found)] = recording_spectra(RecordingSet([short]))
    assert np.isfinite(found.magnitude).all()
    assert not any("drift" in note for note in found.notes)


def test_a_silent_repeat_does_not_count(make_model: ModelMaker) -> None:
    recordings = record(make_model(0.05, LAYERS))
    floor = replace(recordings[0], samples=1e-4 * recordings[0].samples, force_n=0.0)
    silent = replace(recordings[1], samples=floor.samples, repeat=2)
    with_it, without = fit_texture([*recordings, silent, floor]), fit_texture([*recordings, floor])
    assert np.array_equal(with_it.gains, without.gains)
