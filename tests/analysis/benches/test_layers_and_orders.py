"""The bench of layers and orders: on planted truths the right size wins, and the table says how."""

from __future__ import annotations

import importlib.util
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from scipy.signal import lfilter

from analysis.benches.layers_and_orders import AR, CHOSEN, EQUAL, layers_and_orders
from modeling import PEQ, ARFilter, InputError, Recording

STUDY = Path(__file__).parents[3] / "docs/studies/layers_and_orders.py"
TRUE_AR = ARFilter(coefficients=[-1.6, 1.2, -0.5, 0.12], gain=0.1, rate_hz=1000.0)


def ar_record(seed: int) -> Recording:
    noise = np.random.default_rng(seed).standard_normal(3000)
    samples = lfilter([TRUE_AR.gain], [1.0, *TRUE_AR.coefficients], noise)[1000:]
    return Recording(samples, 1000.0, 100.0, 1.0, "planted", simulated=True)


def test_rows_and_columns_of_the_table() -> None:
    table = layers_and_orders([(ar_record(0), TRUE_AR)], layers=(1, 2), orders=(2, 4))
    rows = list(zip(table.model, table["size"], table.numbers, strict=True))
    expected = [(AR, 2, 3), (AR, 4, 5)]
    expected += [(kind, m, 1 + 3 * m) for kind in (CHOSEN, EQUAL) for m in (1, 2)]
    assert rows == expected
    assert table.simulated.all()
    assert (table.records == 1).all()
    assert (table.floor_gfc30 < table.gfc30).all()
    assert table.expected_gfc30.nunique() == 1


def test_planted_autoregression_is_matched_by_its_own_order() -> None:
    cases = [(ar_record(seed), TRUE_AR) for seed in range(4)]
    table = layers_and_orders(cases, layers=(1,), orders=(1, 4)).set_index(["model", "size"])
    distance = table.distance_to_truth_db
    # Two seconds of 1 kHz: four coefficients to 2 %, some tenths of a dB.
    assert distance[AR, 4] < 0.8
    assert distance[AR, 1] > 3 * distance[AR, 4]
    assert table.level_error_db[AR, 4] < 0.3


def test_chosen_signs_beat_equal_ones_where_signs_differ() -> None:
    truth = PEQ(
        noise_gain=0.01,
        frequencies_hz=[60.0, 250.0],
        bandwidths_hz=[30.0, 60.0],
        gains=[0.5, -0.3],
        rate_hz=1000.0,
    )
    frequency = np.fft.rfftfreq(4000, 1e-3)
    rng = np.random.default_rng(1)
    cases = []
    for _ in range(3):
        spectrum = truth.response(frequency) * np.fft.rfft(rng.standard_normal(4000))
        samples = np.fft.irfft(spectrum)
        cases.append((Recording(samples, 1000.0, 100.0, 1.0, "planted", simulated=True), truth))
    table = layers_and_orders(cases, layers=(2,), orders=(6,)).set_index(["model", "size"])
    distance = table.distance_to_truth_db
    assert distance[CHOSEN, 2] < 0.8
    assert distance[EQUAL, 2] > 2 * distance[CHOSEN, 2]
    assert distance[AR, 6] > 2 * distance[CHOSEN, 2]


def test_study_prints_the_table_of_a_toolkit_file(
    tmp_path: Path, hatt_xml: Callable[..., str], capsys: pytest.CaptureFixture[str]
) -> None:
    specification = importlib.util.spec_from_file_location("layers_and_orders_study", STUDY)
    assert specification is not None
    assert specification.loader is not None
    study = importlib.util.module_from_spec(specification)
    specification.loader.exec_module(study)
    (tmp_path / "Models_A.xml").write_text(hatt_xml(), encoding="utf-8")
    table = study.main([str(tmp_path / "Models_A.xml")])
    printed = capsys.readouterr().out
    # Of five filters those at (300, 4) and (160, 1.5) vibrate.
    assert (table.records == 2).all()
    assert "simulated records of 1 toolkit textures, 2 conditions, 1 s each" in printed
    for kind in (AR, EQUAL, CHOSEN):
        assert kind in printed
    with pytest.raises(InputError, match="expected toolkit files, got none"):
        study.main([])
