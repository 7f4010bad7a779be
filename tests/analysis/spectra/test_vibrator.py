"""A vibrator before and after: what is compared, and that the picture shows it."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from matplotlib.figure import Figure
from matplotlib.text import Text

from tactileq.analysis.spectra.figures.vibrator import (
    figure_vibrator,
    plot_coherence,
    plot_compensation,
)
from tactileq.analysis.spectra.vibrator import CompensatedVibrator, compensated
from tactileq.modeling import Vibrator, compensation_for
from tactileq.stimuli.planted.vibrators import SimulatedVibrator

pytestmark = pytest.mark.filterwarnings("error")
CURVE_HZ = np.geomspace(10.0, 2440.0, 600)


def vibrator(response: np.ndarray | None = None, **changed: object) -> Vibrator:
    """A resonance at 80 Hz, 16 Hz wide, 5 times a flat part of 0.2, as one layer exactly."""
    found = Vibrator(
        rate_hz=5000.0,
        frequency_hz=80.0,
        bandwidth_hz=16.0,
        height=5.0,
        flat_gain=0.2,
        coherence=0.97,
        lowest_hz=40.0,
        highest_hz=320.0,
        curve_hz=CURVE_HZ,
        curve_response=np.ones(600),
        curve_coherence=np.full(600, 0.97),
        simulated=True,
    )
    curve = found.peq.response(CURVE_HZ) if response is None else response
    return replace(found, curve_response=curve, **changed)


@pytest.fixture
def shown() -> CompensatedVibrator:
    return compensated(vibrator())


def texts(figure: Figure) -> str:
    return "\n".join(text.get_text() for text in figure.findobj(Text))


def test_a_layer_is_flat_afterwards_and_mistuned_it_is_not(shown) -> None:
    assert shown.after_db == pytest.approx(np.zeros(600), abs=1e-9)
    assert shown.before_db.max() == pytest.approx(20 * np.log10(5), abs=0.01)
    assert shown.flat_after_hz == (CURVE_HZ[0], CURVE_HZ[-1])
    low, high = shown.flat_before_hz
    assert 80.0 < low < 200.0
    assert high == CURVE_HZ[-1]
    # The largest deviation of 1 + (R − 1)·H times a notch that stands 10 % off, computed here.
    for off, left_db in zip(shown.mistunings, shown.left_db, strict=True):
        k = np.tan(np.pi * 16.0 / 5000.0)
        numbers = {"k": k, "g": np.tan(np.pi * 80.0 / 5000.0)}
        wide = {"k": 5 * k, "g": np.tan(np.pi * 80.0 * (1 + off) / 5000.0)}
        tangent = np.tan(np.pi * CURVE_HZ / 5000.0)
        layer, notch = (
            1 / (1 - 1j * (n["g"] ** 2 / tangent - tangent) / (n["k"] * (1 + n["g"] ** 2)))
            for n in (numbers, wide)
        )
        product_db = 20 * np.log10(np.abs((1 + 4 * layer) * (1 - 0.8 * notch)))
        assert left_db == pytest.approx(np.abs(product_db).max(), abs=1e-6)
        assert left_db > 3


def test_of_a_mass_on_a_spring_a_high_pass_is_left() -> None:
    # With f, B = f/Q and R = Q the notch takes out the poles and puts a quality of 1 in their
    # place: 1.25 dB too much at √2·f, −3 dB at 0.786 f.
    truth = np.abs(SimulatedVibrator(80.0, 5.0, 5000.0).response(CURVE_HZ))
    shown = compensated(vibrator(0.2 * truth))
    assert shown.after_db.max() == pytest.approx(10 * np.log10(4 / 3), abs=0.02)
    assert CURVE_HZ[np.argmax(shown.after_db)] == pytest.approx(80.0 * np.sqrt(2), rel=0.02)
    assert shown.flat_after_hz[0] == pytest.approx(0.786 * 80.0, rel=0.02)
    assert shown.flat_before_hz[0] == pytest.approx(80.0 / np.sqrt(1 - 10 ** (-3 / 20)), rel=0.03)


def test_lines_without_response_are_drawn_as_gaps() -> None:
    curve = vibrator().curve_response * (CURVE_HZ < 1000)
    shown = compensated(vibrator(curve))
    assert shown.flat_after_hz[1] < 1000
    figure = figure_vibrator(shown)
    figure.canvas.draw()
    assert all(np.isfinite(ax.get_ylim()).all() for ax in figure.axes)


def test_the_picture_shows_the_curves_and_says_what_they_are(shown) -> None:
    figure = figure_vibrator(shown)
    said = texts(figure)
    assert "Simulated vibrator: resonance at 80.0 Hz, 16.0 Hz wide, 5.00 times" in said
    assert "SIMULATED" in said
    for label in (
        "without compensation",
        "with compensation",
        "with a notch 10% too low",
        "with a notch 10% too high",
        "flat to ±3 dB with: 10 to 2440 Hz",
        "fitted: 40 to 320 Hz",
        "least median: 0.8",
        "response re flat part (dB)",
        "coherence γ²",
        "frequency (Hz)",
    ):
        assert label in said
    lines = {line.get_label(): line for ax in figure.axes for line in ax.lines}
    for label, curve in (
        ("without compensation", shown.before_db),
        ("with compensation", shown.after_db),
        ("with a notch 10% too low", shown.mistuned_db[0]),
        ("with a notch 10% too high", shown.mistuned_db[1]),
    ):
        assert (lines[label].get_ydata() == curve).all()
        assert (lines[label].get_xdata() == CURVE_HZ).all()
    (band,) = (
        line for label, line in lines.items() if str(label).startswith("flat to ±3 dB with:")
    )
    assert tuple(band.get_xdata()) == shown.flat_after_hz


def test_a_real_vibrator_is_not_called_simulated() -> None:
    shown = compensated(vibrator(simulated=False))
    assert "simulated" not in texts(figure_vibrator(shown)).lower()
    for plot in (plot_compensation, plot_coherence):
        assert plot(shown).lines


def test_mistunings_can_be_chosen() -> None:
    shown = compensated(vibrator(), mistunings=(0.02,))
    assert shown.mistuned_db.shape == (1, 600)
    assert shown.compensation == compensation_for(shown.vibrator)
    assert 0.1 < shown.left_db[0] < compensated(vibrator()).left_db[1]
