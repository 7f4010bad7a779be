"""Grids over the range of a toolkit file: closed forms, files of scattered strokes, bad files."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from itertools import product
from pathlib import Path

import numpy as np
import pytest
from scipy.spatial import Delaunay

from tactileq.modeling import InputError
from tactileq.rig.recording.importing.hatt import HattTexture
from tactileq.rig.recording.importing.hatt_grid import spanning_grid
from tactileq.rig.recording.importing.hatt_reader import load_hatt
from tests.refusals import refused

Xml = Callable[..., str]
SILENT = [(0.0, 0.0), (400.0, 0.0), (0.0, 4.0)]
FIXED = list(product(50.0 * np.arange(1, 8), 0.5 * np.arange(1, 8)))


def scattered(conditions: Sequence[tuple[float, float]]) -> HattTexture:
    """Filters that are silent at rest and at no force."""
    places = np.array(conditions, dtype=float)
    n = len(places)
    return HattTexture(
        material="scattered",
        rate_hz=1000.0,
        conditions=places,
        triangles=Delaunay(places).simplices.astype(np.intp),
        ar_frequencies=np.tile([1.0, 2.0], (n, 1)),
        ma_frequencies=np.zeros((n, 0)),
        variances=places.prod(axis=1),
        gains=np.ones(n),
    )


# --- closed forms


def test_a_rectangle_is_covered_by_equal_steps() -> None:
    grid = spanning_grid(scattered([(100, 1), (220, 1), (100, 2.2), (220, 2.2)]))
    assert grid.speeds.values == pytest.approx([100, 120, 140, 160, 180, 200, 220])
    assert grid.forces.values == pytest.approx([1, 1.2, 1.4, 1.6, 1.8, 2, 2.2])
    assert (grid.speeds.spacing, grid.forces.spacing) == ("linear", "linear")
    assert (grid.inside, len(grid.conditions)) == (49, 49)


def test_equal_ratios_are_taken_where_they_keep_more_nodes() -> None:
    """Under the falling diagonal: 7 + 6 + … + 1 nodes by equal steps, and 32 by equal ratios."""
    texture = scattered([(100, 1), (300, 1), (100, 3)])
    grid = spanning_grid(texture)
    assert grid.speeds.values == pytest.approx([100 * 3 ** (step / 6) for step in range(7)])
    assert (grid.speeds.spacing, grid.forces.spacing) == ("logarithmic", "logarithmic")
    assert grid.inside == 32
    records = texture.recordings(grid.speeds.values, grid.forces.values, duration_s=0.1)
    assert len(records) == 32


def test_equal_steps_are_taken_where_they_keep_more_nodes() -> None:
    """Above the falling diagonal: 28 by equal steps, and 19 by equal ratios."""
    grid = spanning_grid(scattered([(300, 3), (300, 1), (100, 3)]))
    assert (grid.speeds.spacing, grid.forces.spacing) == ("linear", "linear")
    assert grid.inside == 28


def test_silent_filters_belong_to_the_hull_and_not_to_the_range() -> None:
    grid = spanning_grid(scattered([*SILENT, (100, 1), (200, 2)]))
    assert (grid.speeds.values[0], grid.speeds.values[-1]) == (100, 200)
    assert (grid.forces.values[0], grid.forces.values[-1]) == (1, 2)
    assert grid.inside == 49


def test_the_ends_are_the_file_s_own_to_the_last_bit() -> None:
    """Rounded outwards they would leave the hull."""
    low, high = (37.123457, 0.1234571), (123.456789, 2.987653)
    grid = spanning_grid(scattered([*SILENT, low, high]))
    for axis, ends in ((grid.speeds, (low[0], high[0])), (grid.forces, (low[1], high[1]))):
        assert (axis.values[0], axis.values[-1]) == ends


@pytest.mark.parametrize("nearly", [100.0, 100.00001])
def test_one_speed_is_one_value(nearly: float) -> None:
    """Seven speeds between two that differ by rounding would be one."""
    grid = spanning_grid(scattered([*SILENT, (100, 1), (nearly, 2.5)]))
    assert grid.speeds.values == (100.0,)
    assert len(grid.forces.values) == 7
    assert grid.inside == 7
    assert "1 speed of 100 mm/s" in grid.describe()


def test_axes_that_are_given_stay() -> None:
    texture = scattered([(100, 1), (300, 1), (100, 3)])
    both = spanning_grid(texture, speeds_mm_s=[150, 100], forces_n=[1.0, 2.0])
    assert both.conditions == [(150, 1), (150, 2), (100, 1), (100, 2)]
    assert both.inside == 4
    one = spanning_grid(texture, speeds_mm_s=[150])
    assert one.speeds.values == (150.0,)
    assert (one.forces.values[0], one.forces.values[-1]) == (1, 3)
    assert one.inside == len(texture.conditions_inside(one.conditions))


def test_the_description_states_ranges_spacing_and_cover() -> None:
    told = spanning_grid(scattered([(100, 1), (300, 1), (100, 3)])).describe()
    for fact in ("7 speeds of 100 to 300 mm/s", "7 forces of 1 to 3 N", "logarithmic", "32 of 49"):
        assert fact in told


# --- files of scattered strokes


def faster_presses_less(rng: np.random.Generator) -> np.ndarray:
    """Shares of the range under its falling diagonal."""
    along, between = np.sqrt(rng.uniform(size=30)), rng.uniform(size=30)
    return np.stack([along * between, along * (1 - between)], axis=-1)


def any_force_at_any_speed(rng: np.random.Generator) -> np.ndarray:
    return rng.uniform(size=(30, 2))


def mostly_slow_and_light(rng: np.random.Generator) -> np.ndarray:
    return np.clip(np.exp(rng.normal(-1.2, 0.6, (30, 2))), 0, 1)


@pytest.mark.parametrize("seed", range(3))
@pytest.mark.parametrize(
    "layout", [faster_presses_less, any_force_at_any_speed, mostly_slow_and_light]
)
def test_most_nodes_of_files_of_strokes_are_kept(
    tmp_path: Path,
    hatt_xml: Xml,
    layout: Callable[[np.random.Generator], np.ndarray],
    seed: int,
) -> None:
    """At least 35 of 49, and twice as many as of the same grid for all files."""
    rng = np.random.default_rng(seed)
    lowest, highest = rng.uniform([11, 0.05], [30, 0.4]), rng.uniform([120, 1.5], [308, 8])
    loud = np.round(lowest + layout(rng) * (highest - lowest), 6)
    fastest, strongest = loud.max(axis=0).tolist()
    silent = [(0, 0), (fastest, 0), (0, strongest)]
    path = tmp_path / "Models_Strokes.xml"
    path.write_text(hatt_xml(conditions=[*silent, *loud.tolist()]), encoding="utf-8")
    texture = load_hatt(path)
    grid = spanning_grid(texture)
    for axis, values in ((grid.speeds.values, loud[:, 0]), (grid.forces.values, loud[:, 1])):
        assert (axis[0], axis[-1]) == (values.min(), values.max())
    assert grid.inside == len(texture.conditions_inside(grid.conditions))
    assert grid.inside >= 35
    assert grid.inside >= 2 * len(texture.conditions_inside(FIXED))


# --- what has no range


def test_filters_at_one_condition_have_no_range() -> None:
    for loud in ([(100.0, 1.0)], [(100.0, 1.0), (100.00001, 1.0000001)]):
        texture = scattered([*SILENT, *loud])
        got = ["100 mm/s", "1 N"]
        with refused(InputError, names="scattered", expected="two conditions", got=got):
            spanning_grid(texture)
        assert spanning_grid(texture, speeds_mm_s=[100], forces_n=[0.5, 1.0]).inside == 2


def test_silent_files_have_no_range() -> None:
    texture = scattered([*SILENT, (400.0, 0.0)])
    with refused(InputError, names="scattered", expected="vibration", got=["none", "4 models"]):
        spanning_grid(texture)


@pytest.mark.parametrize("axis", ["speeds_mm_s", "forces_n"])
@pytest.mark.parametrize("value", [0.0, -1.0, np.nan, np.inf])
def test_impossible_axes_are_refused(axis: str, value: float) -> None:
    texture = scattered([(100, 1), (300, 1), (100, 3)])
    with refused(InputError, names="scattered", expected=[0, "mm/s", "N"], got=f"{value:g}"):
        spanning_grid(texture, **{axis: [1.0, value]})
