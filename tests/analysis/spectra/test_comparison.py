"""Pictures of models: one condition with layers and thresholds, and layers over the grid."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from matplotlib.figure import Figure
from matplotlib.text import Text

from tactileq.analysis.spectra.comparison import compare_condition, compare_spectra, spectrum_panels
from tactileq.analysis.spectra.figures.layers_over_grid import (
    QUANTITIES,
    figure_layers_over_grid,
    plot_layers_over_grid,
)
from tactileq.analysis.spectra.figures.spectra import (
    figure_spectra,
    figure_spectra_and_threshold,
    plot_model_spectrum,
)
from tactileq.analysis.spectra.layers_over_grid import layers_over_grid
from tactileq.analysis.textures.results import TextureResult
from tactileq.modeling import CRITERIA, InputError, RecordingSet, TextureModel, Threshold, simplify
from tactileq.modeling.estimation.estimators import find_layers
from tactileq.modeling.fitting.conditions import recording_spectra
from tactileq.modeling.perception.amplitudes import layer_amplitudes_g
from tactileq.modeling.perception.signs_of_rest import with_signs_chosen_again
from tactileq.modeling.recordings.spectrum import high_pass_response, mean_spectrum, smooth
from tactileq.stimuli.planted.textures import record_texture
from tests.refusals import refused

pytestmark = pytest.mark.filterwarnings("error")
# A layer at 40 Hz far below the threshold, one at 250 Hz far above it, one where none is known.
FREQUENCIES_HZ = (40.0, 250.0, 900.0)
BANDWIDTHS_HZ = (20.0, 80.0, 150.0)
GAINS = (1e-4, -2.0, 0.5)


@pytest.fixture
def model() -> TextureModel:
    shape = (2, 2, 3)
    return TextureModel(
        texture="felt",
        rate_hz=5000.0,
        speeds_mm_s=np.array([100.0, 200.0]),
        forces_n=np.array([1.0, 2.0]),
        noise_gains=np.full((2, 2), 0.01),
        frequencies_hz=np.broadcast_to(FREQUENCIES_HZ, shape),
        bandwidths_hz=np.broadcast_to(BANDWIDTHS_HZ, shape),
        gains=np.broadcast_to(GAINS, shape),
        level_sd_db=np.zeros(shape),
        estimator="planted",
    )


def texts(figure: Figure) -> str:
    return "\n".join(text.get_text() for text in figure.findobj(Text))


def lines_named(ax, label: str) -> list:
    return [line for line in ax.lines if line.get_label() == label]


@pytest.mark.parametrize("criterion", CRITERIA)
def test_a_layer_stands_above_its_drawn_threshold_as_its_amplitude_does(model, criterion) -> None:
    """Of each layer alone."""
    threshold = Threshold.shipped("codec")
    amplitudes = layer_amplitudes_g(model.peq(150.0, 1.5), criterion=criterion)
    result = simplify(model, threshold, criterion=criterion)
    shown = compare_condition(model, result, speed_mm_s=150.0, force_n=1.5)
    for layer, (frequency, gain) in enumerate(zip(FREQUENCIES_HZ[:2], GAINS[:2], strict=True)):
        at = int(frequency)  # the axis has steps of 1 Hz
        assert shown.frequency_hz[at] == frequency
        assert shown.layer_response[layer, at] == pytest.approx(abs(gain), rel=1e-12)
        drawn = shown.layer_response[layer, at] / shown.layer_threshold[layer, at]
        compared = amplitudes[layer] / threshold.at(frequency)
        assert drawn == pytest.approx(compared, rel=1e-12)
    # None is known at 900 Hz: its last level is drawn as a lower bound.
    bound = shown.layer_response[2, 900] / shown.layer_threshold[2, 900]
    compared = amplitudes[2] / threshold.at(400.0)
    assert bound == pytest.approx(compared, rel=1e-12)
    known_only = simplify(model, threshold, criterion=criterion, hold_above=False)
    shown = compare_condition(model, known_only, speed_mm_s=150.0, force_n=1.5)
    assert np.isnan(shown.layer_threshold[2]).all()


@pytest.mark.parametrize("criterion", CRITERIA)
def test_amplitudes_are_those_of_the_criterion(model, criterion) -> None:
    """By `energy` that of the change of power: by a sum over frequency."""
    result = simplify(model, Threshold.shipped("codec"), criterion=criterion)
    shown = compare_condition(model, result, speed_mm_s=150.0, force_n=1.5)
    peq = model.peq(150.0, 1.5)
    if criterion != "energy":
        assert (shown.layer_amplitude_g == layer_amplitudes_g(peq, criterion=criterion)).all()
        return
    frequency = np.arange(0.05, 2500.0, 0.1)
    for layer in range(3):
        others = [other for other in range(3) if other != layer]
        fewer = with_signs_chosen_again(model, others).peq(150.0, 1.5)
        change = np.abs(peq.response(frequency) ** 2 - fewer.response(frequency) ** 2)
        assert shown.layer_amplitude_g[layer] ** 2 == pytest.approx(2 * change.mean(), rel=2e-3)


def test_thresholds_are_drawn_a_quarter_octave_around_their_layers(model) -> None:
    result = simplify(model, Threshold.shipped("codec"))
    shown = compare_condition(model, result, speed_mm_s=100.0, force_n=1.0)
    drawn = shown.frequency_hz[np.isfinite(shown.layer_threshold[1])]
    assert (drawn[0], drawn[-1]) == (np.ceil(250 / 2**0.25), np.floor(250 * 2**0.25))


def test_a_condition_without_recording_anywhere_within_the_grid(model) -> None:
    result = simplify(model, Threshold.shipped("codec"))
    shown = compare_condition(model, result, speed_mm_s=123.0, force_n=1.7)
    expected = smooth(model.peq(123.0, 1.7).response(np.arange(2501.0)), 30.0, step_hz=1.0)
    assert shown.full == pytest.approx(expected, rel=1e-12)
    figure = figure_spectra_and_threshold(shown)
    figure.draw_without_rendering()
    assert "felt, 123 mm/s, 1.7 N" in texts(figure)
    assert "recording" not in texts(figure).replace("model and recording smoothed", "")
    assert "SIMULATED" not in texts(figure)
    for speed, force in ((99.0, 1.0), (201.0, 1.0), (150.0, 0.5), (150.0, 2.5)):
        with refused(
            InputError,
            expected=["'felt'", "100 to 200 mm/s", "1 to 2 N"],
            got=[f"{speed:g} mm/s", f"{force:g} N"],
        ):
            compare_condition(model, result, speed_mm_s=speed, force_n=force)


def test_dropped_layers_are_drawn_as_dropped_and_gone_from_the_simplified_model(model) -> None:
    result = simplify(model, Threshold.shipped("codec"))
    assert [verdict.verdict for verdict in result.layers] == ["dropped", "kept", "kept"]
    shown = compare_condition(model, result, speed_mm_s=100.0, force_n=1.0)
    full, simplified = (plot_model_spectrum(shown, model=name) for name in ("full", "simplified"))
    (dropped,) = lines_named(full, "dropped layer alone")
    (kept,) = lines_named(full, "layer alone, not smoothed")
    assert np.array_equal(dropped.get_ydata(), shown.layer_response[0])
    assert np.array_equal(kept.get_ydata(), shown.layer_response[1])
    assert dropped.get_linestyle() != kept.get_linestyle()
    assert not lines_named(simplified, "dropped layer alone")
    drawn = [line.get_ydata() for line in simplified.lines]
    assert not any(np.array_equal(values, shown.layer_response[0]) for values in drawn)


def test_recording_and_model_stand_in_one_picture(results) -> None:
    shown = compare_spectra(results[0], speed_mm_s=350.0, force_n=3.0)
    ax = plot_model_spectrum(shown, model="full")
    (recording,) = lines_named(ax, "recording")
    measured = results[0].spectrum_at(350.0, 3.0).smoothed()
    assert np.array_equal(recording.get_ydata(), measured)
    low, high = ax.get_ylim()
    assert low < shown.full.min()
    assert high > measured.max()


def test_a_model_beside_a_recording_is_as_high_at_low_frequencies(model) -> None:
    """Of white noise a recording lacks what lies below 10 Hz, and so do both models beside it."""
    flat = replace(model, gains=np.zeros((2, 2, 3)), noise_gains=np.ones((2, 2)))
    records = record_texture(flat, duration_s=20.0, seed=2)
    result = TextureResult(records, flat, simplify(flat, Threshold.shipped("codec")))
    shown = compare_spectra(result, speed_mm_s=100.0, force_n=1.0)
    low = (shown.frequency_hz >= 10) & (shown.frequency_hz <= 30)
    for model in (shown.full, shown.simplified):
        assert (model / shown.recording)[low].mean() == pytest.approx(1.0, abs=0.04)
        assert model[low].mean() < 0.9 * flat.noise_gains[0, 0]


def marked_model(model: TextureModel) -> TextureModel:
    inherited = np.zeros(model.gains.shape, dtype=bool)
    unresolved, interpolated = inherited.copy(), np.zeros((2, 2), dtype=bool)
    inherited[0, 1, 2] = unresolved[1, 0, 1] = interpolated[1, 1] = True
    return replace(model, inherited=inherited, unresolved=unresolved, interpolated=interpolated)


@pytest.mark.parametrize("quantity", QUANTITIES)
def test_layers_over_the_grid_with_their_marks(model, quantity: str) -> None:
    layers = layers_over_grid(marked_model(model))
    ax = plot_layers_over_grid(layers, quantity=quantity)
    ax.figure.draw_without_rendering()
    values = getattr(layers, quantity)
    # Per layer: a line per force, the mean, and one line of marks per kind.
    per_layer = [ax.lines[start : start + 6] for start in range(0, 18, 6)]
    assert len(ax.lines) == 18
    for layer, (*forces, mean, inherited, unresolved, interpolated) in enumerate(per_layer):
        for force, line in enumerate(forces):
            assert line.get_ydata().tolist() == values[:, force, layer].tolist()
        assert mean.get_ydata() == pytest.approx(values[:, :, layer].mean(axis=1), rel=1e-12)
        assert mean.get_linewidth() > 2 * forces[0].get_linewidth()
        assert {line.get_color() for line in (*forces, mean, inherited)} == {mean.get_color()}
        assert inherited.get_xdata().tolist() == ([100.0] if layer == 2 else [])
        assert unresolved.get_xdata().tolist() == ([200.0] if layer == 1 else [])
        assert interpolated.get_ydata().tolist() == [values[1, 1, layer]]
    assert ax.get_yscale() == "log"
    assert ax.get_xlabel() == "speed (mm/s)"
    assert {"frequency_hz": "(Hz)", "amplitude": "(g peak)"}[quantity] in ax.get_ylabel()


def test_the_legend_names_layers_and_only_marks_that_are_there(model) -> None:
    figure = figure_layers_over_grid(layers_over_grid(marked_model(model)))
    figure.draw_without_rendering()
    for words in ("layer 3", "inherited", "not resolved", "interpolated", "felt", "1 to 2 N"):
        assert words in texts(figure)
    assert "SIMULATED" not in texts(figure)
    plain = replace(model, simulated=True, unit="arbitrary")
    figure = figure_layers_over_grid(layers_over_grid(plain))
    assert texts(figure).count("SIMULATED") == 2
    assert "(arbitrary)" in texts(figure)
    assert "inherited" not in texts(figure)


def test_layers_without_power_or_no_layers_at_all_can_be_drawn(model) -> None:
    silent = replace(model, gains=np.zeros((2, 2, 3)))
    for drawn in (silent, model.with_layers([])):
        figure = figure_layers_over_grid(layers_over_grid(drawn))
        figure.draw_without_rendering()
        assert len(figure.axes) == 2
        assert all(np.isfinite(ax.get_ylim()).all() for ax in figure.axes)


def test_panels_average_repeats_and_show_the_model_that_was_fitted(results) -> None:
    first, *others = results[0].recordings.recordings
    again = replace(others[0], speed_mm_s=first.speed_mm_s, force_n=first.force_n, repeat=2)
    measured = recording_spectra(RecordingSet([first, again, *others]))
    model = results[0].model
    panels = spectrum_panels(measured, estimator="paper", model=model)
    assert len(panels) == 1 + len(others)
    mean = mean_spectrum([measured[0][1], measured[1][1]])
    assert np.array_equal(panels[0].magnitude, mean.smoothed())
    alone = find_layers(measured[2][1], estimator="paper")
    assert np.array_equal(panels[1].layer_frequency_hz, alone.frequencies_hz)
    peq = model.peq(*first.condition)
    high_pass = high_pass_response(mean.frequency_hz, rate_hz=5000.0)
    expected = smooth(peq.response(mean.frequency_hz) * high_pass, 30.0, step_hz=2.0)
    assert panels[0].response == pytest.approx(expected, rel=1e-12)
    figure = figure_spectra(panels)
    figure.draw_without_rendering()
    assert "high-pass" in texts(figure)
    bare = figure_spectra(spectrum_panels(measured, estimator="paper"))
    assert "high-pass" not in texts(bare)
