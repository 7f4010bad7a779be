"""One layer, one name: docs/method/fitting.md#tracking as a table and as properties."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from tactileq.modeling.fitting.paper_naming import assign_peaks, reference_of, visiting_order


@pytest.mark.parametrize(
    ("peaks", "layers", "expected"),
    [
        pytest.param([], [100.0], [-1], id="no peaks"),
        pytest.param([100.0], [], [], id="no layers"),
        pytest.param([110.0], [100.0], [0], id="single layer"),
        pytest.param([149.0], [100.0], [0], id="single layer reaches f/2 up"),
        pytest.param([51.0], [100.0], [0], id="single layer reaches f/2 down"),
        pytest.param([151.0], [100.0], [-1], id="beyond f/2"),
        pytest.param([49.0], [100.0], [-1], id="below f/2"),
        pytest.param([105.0, 290.0], [100.0, 300.0], [0, 1], id="one each"),
        pytest.param([199.0], [100.0, 300.0], [0, -1], id="just inside the lower half gap"),
        pytest.param([201.0], [100.0, 300.0], [-1, 0], id="just inside the upper half gap"),
        pytest.param([1.0], [100.0, 300.0], [0, -1], id="lowest uses its inner gap below"),
        pytest.param([240.0], [300.0, 400.0], [-1, -1], id="beyond the lowest's inner gap"),
        pytest.param([399.0], [100.0, 300.0], [-1, 0], id="highest uses its inner gap above"),
        pytest.param([401.0], [100.0, 300.0], [-1, -1], id="beyond the highest's inner gap"),
        pytest.param([349.0, 351.0], [100.0, 200.0, 300.0], [-1, -1, 0], id="gap of 100 → 50"),
        pytest.param([60.0, 130.0], [100.0, 300.0], [1, -1], id="conflict: the nearest wins"),
        pytest.param([90.0, 95.0, 104.0], [100.0, 300.0], [2, -1], id="conflict of three"),
        pytest.param([170.0], [100.0, 160.0, 400.0], [-1, 0, -1], id="uneven gaps"),
        pytest.param([270.0], [100.0, 160.0, 400.0], [-1, 0, -1], id="wide gap above"),
        pytest.param([205.0, 95.0], [200.0, 100.0], [0, 1], id="any order"),
    ],
)
def test_table_of_cases(peaks: list[float], layers: list[float], expected: list[int]) -> None:
    assert assign_peaks(np.array(peaks), np.array(layers)).tolist() == expected


separate = st.lists(
    st.integers(2, 2400).map(lambda n: n + 0.0), max_size=8, unique=True
)  # whole numbers; peaks get an odd offset, so that no two distances are equal by chance


@settings(deadline=None, max_examples=300)
@given(separate, separate, st.randoms(use_true_random=False))
def test_properties(peaks_hz: list[float], layers_hz: list[float], random) -> None:
    peaks = np.array(peaks_hz) + np.linspace(0.01, 0.09, len(peaks_hz))
    layers = np.array(layers_hz)
    chosen = assign_peaks(peaks, layers)
    used = chosen[chosen >= 0]
    assert chosen.shape == layers.shape
    assert len(set(used.tolist())) == used.size  # no peak twice
    for layer, peak in enumerate(chosen):
        if peak >= 0:  # a peak belongs to the nearest layer …
            assert abs(peaks[peak] - layers[layer]) == np.abs(peaks[peak] - layers).min()
        nearest = [p for p in range(peaks.size) if np.argmin(np.abs(peaks[p] - layers)) == layer]
        if peak >= 0 and len(nearest) > 1:  # … and of several the nearest wins
            assert np.abs(peaks[nearest] - layers[layer]).min() == abs(peaks[peak] - layers[layer])
    named = layers[chosen >= 0]
    order = np.argsort(named)
    assert (np.diff(peaks[used][order]) > 0).all()  # layers keep their order
    check_permutations(peaks, layers, chosen, random)


def check_permutations(peaks: np.ndarray, layers: np.ndarray, chosen: np.ndarray, random) -> None:
    """Shuffling layers shuffles the answer; shuffling peaks renames them."""
    by_layer = random.sample(range(layers.size), layers.size)
    assert assign_peaks(peaks, layers[by_layer]).tolist() == chosen[by_layer].tolist()
    by_peak = random.sample(range(peaks.size), peaks.size)
    again = assign_peaks(peaks[by_peak], layers)
    renamed = [by_peak[p] if p >= 0 else -1 for p in again]
    assert renamed == chosen.tolist()


def test_a_peak_at_each_layer_is_found() -> None:
    layers = np.array([40.0, 180.0, 285.0, 388.0])
    assert assign_peaks(layers, layers).tolist() == [0, 1, 2, 3]


def test_visiting_order_is_force_by_force_downwards() -> None:
    grid = [(v, f) for v in (50.0, 200.0, 350.0) for f in (0.5, 2.0, 3.5)]
    assert visiting_order(grid) == [
        (350.0, 3.5),
        (200.0, 3.5),
        (50.0, 3.5),
        (350.0, 2.0),
        (200.0, 2.0),
        (50.0, 2.0),
        (350.0, 0.5),
        (200.0, 0.5),
        (50.0, 0.5),
    ]


@pytest.mark.parametrize(
    ("condition", "visited", "expected"),
    [
        ((200, 3.5), [(350, 3.5)], (350, 3.5)),
        ((50, 3.5), [(350, 3.5), (200, 3.5)], (200, 3.5)),
        ((350, 2.0), [(350, 3.5), (200, 3.5), (50, 3.5)], (350, 3.5)),
        ((200, 2.0), [(350, 3.5), (200, 3.5), (50, 3.5), (350, 2.0)], (350, 2.0)),
        ((350, 0.5), [(350, 3.5), (350, 2.0), (200, 2.0)], (350, 2.0)),
        ((350, 2.0), [(200, 3.5), (50, 3.5)], (200, 3.5)),
        ((350, 1.0), [(350, 3.5), (200, 2.0), (50, 2.0)], (350, 3.5)),
    ],
    ids=["faster", "next faster", "stronger", "faster first", "next stronger", "hole", "two holes"],
)
def test_reference(
    condition: tuple[float, float],
    visited: list[tuple[float, float]],
    expected: tuple[float, float],
) -> None:
    assert reference_of(condition, visited) == expected
