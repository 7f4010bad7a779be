"""Every figure says what it shows: labels with units, legends, and SIMULATED where it is."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from matplotlib.axes import Axes
from matplotlib.colors import to_hex
from matplotlib.figure import Figure
from matplotlib.text import Text

from tactileq.analysis.answers.responses import Responses
from tactileq.analysis.chapters.choices.figure import figure_correct_rates
from tactileq.analysis.chapters.claims.forest import figure_forest
from tactileq.analysis.chapters.confusions.figure import figure_confusion, figure_similarities
from tactileq.analysis.chapters.ratings.figure import figure_ratings
from tactileq.analysis.figures.answers import BAR_WIDTH, ROLE_COLOURS
from tactileq.analysis.page.drawing import LAYER_COLOURS, VERMILLION
from tactileq.analysis.spectra.comparison import compare_spectra, spectrum_panels
from tactileq.analysis.spectra.figures.layers_over_speed import figure_layers_over_speed
from tactileq.analysis.spectra.figures.spectra import (
    figure_spectra,
    figure_spectra_and_threshold,
    plot_layers_and_threshold,
)
from tactileq.analysis.spectra.layers_over_grid import layers_over_speed
from tactileq.analysis.statistics.confusion import confusion_matrices
from tactileq.analysis.statistics.verdicts import ClaimFound, claims_found
from tactileq.modeling import InputError, RecordingSet
from tactileq.modeling.fitting.conditions import recording_spectra
from tests.refusals import refused

pytestmark = pytest.mark.filterwarnings("error")
OKABE_ITO = {
    *("#000000", "#e69f00", "#56b4e9", "#009e73", "#f0e442", "#0072b2", "#d55e00", "#cc79a7"),
}


def texts(artist: Figure | Axes) -> str:
    return "\n".join(text.get_text() for text in artist.findobj(Text))


def drawn(figure: Figure) -> list[Axes]:
    """The figure's axes after drawing it, less the colour bar's."""
    figure.draw_without_rendering()
    return [ax for ax in figure.axes if ax.get_label() != "<colorbar>"]


def test_spectra_and_threshold(results):
    figure = figure_spectra_and_threshold(
        compare_spectra(results[0], speed_mm_s=350.0, force_n=3.0)
    )
    axes = drawn(figure)
    assert len(axes) == 4
    assert all("SIMULATED" in texts(ax) for ax in axes)
    assert "leather, 350 mm/s, 3 N" in texts(figure)
    assert "(g per unit noise)" in axes[0].get_ylabel()
    assert "(g peak)" in axes[2].get_ylabel()
    assert [ax.get_xlabel() for ax in axes[2:]] == ["frequency (Hz)"] * 2
    for ax in axes:
        assert ax.get_xscale() == ax.get_yscale() == "log"
    for words in ("(a) full model", "(b) simplified model", "detection threshold (codec)"):
        assert words in texts(figure)
    assert "no threshold known" in texts(figure)


def test_stems_stand_at_the_layers_and_dropped_ones_are_marked(results):
    comparison = compare_spectra(results[0], speed_mm_s=350.0, force_n=3.0)
    dropped = np.zeros(comparison.layer_frequency_hz.size, dtype=bool)
    dropped[0] = True
    ax = plot_layers_and_threshold(replace(comparison, dropped=dropped))
    lines = {str(line.get_label()): line for line in ax.lines}
    kept, gone = lines["layer, kept"], lines["layer, dropped by simplification"]
    assert gone.get_marker() != kept.get_marker()
    assert gone.get_xdata().tolist() == comparison.layer_frequency_hz[:1].tolist()
    lowest = ax.get_ylim()[0]  # weaker layers stand on the lower edge
    expected = np.maximum(comparison.layer_amplitude_g[1:], lowest)
    assert kept.get_ydata() == pytest.approx(expected, rel=1e-12)
    assert (comparison.layer_amplitude_g[1:] > lowest).any()
    numbers = {annotation.get_text() for annotation in ax.texts}
    assert {str(n + 1) for n in range(dropped.size)} <= numbers


def test_a_condition_off_the_grid_is_refused(results):
    with refused(InputError, expected=["recording", "'leather'", "300 mm/s", "3 N"], got="none"):
        compare_spectra(results[0], speed_mm_s=300.0, force_n=3.0)
    with refused(InputError, expected="'leather'", got=["2 N", [1.0, 3.0]]):
        layers_over_speed(results[0].model, force_n=2.0)


def test_ratings(found):
    figure = figure_ratings(found[:2], simulated=True)
    axes = drawn(figure)
    assert [ax.get_ylabel() for ax in axes] == [
        "rated similarity of vibration magnitude (0–100)",
        "rated similarity of frequency pattern (0–100)",
    ]
    for ax in axes:
        assert "SIMULATED" in texts(ax)
        assert "***" in texts(ax)  # the planted effect on PVC
        assert len(ax.patches) >= 14
        assert "wall paper" in [label.get_text() for label in ax.get_xticklabels()]
    for words in ("full model", "simplified model", "95% confidence interval", "Holm"):
        assert words in texts(figure)


def test_correct_rates(found):
    figure = figure_correct_rates(found[2], chance=1 / 7, simulated=True)
    (ax,) = drawn(figure)
    assert "SIMULATED" in texts(ax)
    assert "14.3%" in texts(ax)
    assert "0–1" in ax.get_ylabel()
    assert any(np.allclose(line.get_ydata(), 1 / 7) for line in ax.lines)
    assert "all textures" not in texts(ax)


def test_every_participant_is_a_point_at_their_mean(found):
    means = found[2].values
    ax = drawn(figure_correct_rates(found[2], chance=1 / 7, simulated=True))[0]
    people = [line for line in ax.lines if len(line.get_xdata()) == 2 and line.get_marker() == "o"]
    assert len(people) == 7 * 16
    aluminum = means[means["texture"] == "aluminum"]
    pairs = [tuple(line.get_ydata()) for line in people[:16]]  # textures in alphabetic order
    assert pairs == list(zip(aluminum["reference"], aluminum["other"], strict=True))
    for line in people[:16]:
        left, right = line.get_xdata()
        assert -BAR_WIDTH < left < 0 < right < BAR_WIDTH  # each within its own bar
    assert len({line.get_xdata()[0] for line in people[:16]}) == 16
    again = drawn(figure_correct_rates(found[2], chance=1 / 7, simulated=True))[0]
    places = [[list(line.get_xdata()) for line in each.lines] for each in (ax, again)]
    assert places[0] == places[1]
    assert "one participant" in texts(ax.figure)


def test_lines_of_thresholds_are_told_apart_by_colour_and_by_dashes(results):
    comparison = compare_spectra(results[0], speed_mm_s=350.0, force_n=3.0)
    axes = drawn(figure_spectra_and_threshold(comparison))
    lines = {str(line.get_label()): line for ax in axes for line in ax.lines}
    names = (
        "gain at which the layer alone would just be felt",
        "detection threshold (codec)",
        "assumed lower bound of the threshold",
    )
    colours = {to_hex(lines[name].get_color()) for name in names}
    assert len(colours) == 3
    assert colours < OKABE_ITO
    assert len({str(lines[name]._unscaled_dash_pattern) for name in names}) == 3
    assert set(names) <= set(texts(axes[0].figure).split("\n"))


def test_differences_stand_beside_their_bounds(found: list[ClaimFound]):
    axes = drawn(figure_forest(found, simulated=True))
    assert len(axes) == 3
    for ax, one in zip(axes, found, strict=True):
        factor = 100 if one.claim.measure == "correct" else 1
        (band,) = ax.patches
        assert (band.get_x(), band.get_width()) == (
            pytest.approx(factor * one.claim.bounds[0]),
            pytest.approx(factor * (one.claim.bounds[1] - one.claim.bounds[0])),
        )
        labels = [label.get_text() for label in ax.get_yticklabels()]
        assert labels[0] == "all textures (n = 16)"
        assert labels[1:] == [f"{texture} (n = 16)" for texture in one.tests["texture"][1:]]
        points = [line for line in ax.lines if line.get_marker() != "None"]
        means = [point.get_xdata()[0] for point in points]
        assert means == pytest.approx((factor * one.tests["mean_difference"]).tolist())
        wide, narrow = ax.lines[1].get_xdata(), ax.lines[2].get_xdata()  # 95 % and 90 %
        assert wide[0] < narrow[0] < narrow[1] < wide[1]
        unit = "percentage points" if factor == 100 else "points of the scale"
        assert ax.get_xlabel() == f"simplified − full ({unit})"
        assert "SIMULATED" in texts(ax)
    shown = texts(axes[0].figure)
    for verdict in set(found[0].tests["verdict"]) | {"90% CI", "95% CI", "bounds"}:
        assert verdict in shown


def test_undefined_and_missing_values_do_not_break_the_bars(choices):
    always_right = choices.assign(correct=1.0)
    answers = Responses(
        {"relative": always_right}, simulated_participants=False, simulated_rig=False
    )
    (one,) = claims_found(answers, rng=np.random.default_rng(1))
    figure = figure_correct_rates(one, chance=1 / 7, simulated=False)
    figure.draw_without_rendering()
    heights = {bar.get_height() for bar in figure.axes[0].patches}
    assert heights == {1.0}


def test_confusion_matrices_state_orientation_counts_and_chance(choices):
    matrices = confusion_matrices(choices)
    figure = figure_confusion(matrices, simulated=True)
    axes = drawn(figure)
    assert [ax.get_xlabel() for ax in axes] == ["virtual surface answered"] * 2
    assert axes[0].get_ylabel() == "real surface presented"
    for ax, model in zip(axes, ("full", "simplified"), strict=True):
        assert "SIMULATED" in texts(ax)
        matrix = matrices[model]
        assert f"{100 * matrix.row_shares[0, 0]:.0f}\n({matrix.counts[0, 0]})" in texts(ax)
    assert "chance 14.3%" in texts(figure)
    assert "share of the row's answers (%)" in texts(figure)


@pytest.mark.parametrize("classes", [3, 16])
def test_similarities_of_any_number_of_classes(classes):
    similarities = np.full((classes, classes), 0.25)
    similarities[1, 0] = similarities[0, 1] = np.nan
    names = [f"t{number}" for number in range(classes)]
    figure = figure_similarities({"full": similarities, "AR": similarities}, names, simulated=True)
    axes = drawn(figure)
    assert [ax.get_title(loc="left") for ax in axes] == ["(a) full model", "(b) AR model"]
    for ax in axes:
        shown = [text.get_text() for text in ax.texts if text.get_text() != "SIMULATED"]
        assert len(shown) == classes * (classes - 1) // 2
        assert shown.count("–") == 1
        assert [label.get_text() for label in ax.get_xticklabels()] == names[:-1]
    assert [label.get_text() for label in axes[0].get_yticklabels()] == names[1:]
    assert "SIMULATED" in texts(figure)


def test_layers_over_speed_beside_the_planted_ones(results):
    result = results[0]
    courses = [layers_over_speed(model, force_n=3.0) for model in (result.model, result.truth)]
    figure = figure_layers_over_speed(courses)
    frequency, amplitude = drawn(figure)
    assert frequency.get_ylabel() == "frequency (Hz)"
    assert "(g peak)" in amplitude.get_ylabel()
    for ax in (frequency, amplitude):
        assert ax.get_xlabel() == "speed (mm/s)"
        assert "SIMULATED" in texts(ax)
        assert len(ax.lines) == result.model.n_layers + result.truth.n_layers
    assert "planted" in texts(figure)
    assert f"{result.model.estimator}, layer 1" in texts(figure)
    first = frequency.lines[0]
    assert first.get_ydata().tolist() == result.model.frequencies_hz[:, 1, 0].tolist()


@pytest.mark.parametrize("count", [1, 3])
def test_small_multiples_of_spectra_need_no_grid(results, count):
    recordings = RecordingSet(results[0].recordings.recordings[:count])
    panels = spectrum_panels(recording_spectra(recordings), estimator="paper")
    figure = figure_spectra(panels)
    axes = drawn(figure)
    assert len(axes) == count
    for ax, panel in zip(axes, panels, strict=True):
        assert ax.get_title(loc="left") == panel.title
        assert "mm/s" in panel.title
        assert "SIMULATED" in texts(ax)
        assert ax.lines[1].get_xdata().tolist() == panel.layer_frequency_hz.tolist()
        count = panel.layer_frequency_hz.size
        assert f"{count} layer{'s' * (count != 1)} found alone" in texts(ax)
    assert axes[0].get_ylabel() == "magnitude\n(g per unit noise)"
    assert axes[-1].get_xlabel() == "frequency (Hz)"


def test_real_results_are_not_called_simulated(found, choices):
    for figure in (
        figure_forest(found, simulated=False),
        figure_ratings(found[:2], simulated=False),
        figure_correct_rates(found[2], chance=1 / 7, simulated=False),
        figure_confusion(confusion_matrices(choices), simulated=False),
    ):
        figure.draw_without_rendering()
        assert "SIMULATED" not in texts(figure)


def test_colours_are_okabe_and_itos():
    for colour in (*LAYER_COLOURS, *ROLE_COLOURS.values(), VERMILLION):
        assert to_hex(colour) in OKABE_ITO
