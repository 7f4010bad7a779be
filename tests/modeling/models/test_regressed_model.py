"""Models driven by regressions: planted linear textures, edges, rendering, files."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from tactileq.modeling import InputError, RegressedModel, Renderer, TextureModel, regressed
from tactileq.modeling.models.terms import DrivenBy
from tests.refusals import refused

ModelMaker = Callable[..., TextureModel]
FallingMaker = Callable[..., RegressedModel]
SPEEDS, FORCES = np.array([50.0, 120.0, 350.0]), np.array([0.5, 1.5, 3.5])
V, F = SPEEDS[:, None], FORCES[None, :]
ANY_SPEED = st.floats(width=32) | st.floats(-500, 500)
ANY_FORCE = st.floats(width=32) | st.floats(-1, 5)


def plane(constant: float, a1: float = 0, a2: float = 0, a3: float = 0) -> np.ndarray:
    return constant + a1 * V + a2 * F + a3 * V * F


def planted(
    make_model: ModelMaker,
    *,
    noise: np.ndarray,
    layers: list[tuple[np.ndarray, np.ndarray, np.ndarray]],
) -> TextureModel:
    """A model whose parameters are these functions of speed and force."""
    model = make_model(0.1, [(100.0, 20.0, 1.0)] * len(layers), speeds_mm_s=SPEEDS, forces_n=FORCES)
    names = ("frequencies_hz", "bandwidths_hz", "gains")
    grids = {
        name: np.stack([layer[i] for layer in layers], axis=-1) for i, name in enumerate(names)
    }
    return replace(model, noise_gains=noise, **grids)


@pytest.fixture(scope="module")
def bilinear(make_model: ModelMaker) -> TextureModel:
    """Everything is β + α1·v + α2·F + α3·v·F, in 24 numbers; the second layer is negative."""
    return planted(
        make_model,
        noise=plane(0.1, 2e-4, 0.01, 1e-5),
        layers=[
            (plane(30, 0.5, 4, -0.01), plane(20, a3=0.01), plane(0.2, 1e-3, -0.02, 3e-4)),
            (plane(430, 0.5, 4, -0.01), plane(60, -0.02), -plane(0.1, 1e-3, 0.02, 3e-4)),
        ],
    )


@pytest.fixture(scope="module")
def without_grid(bilinear: TextureModel) -> RegressedModel:
    return regressed(bilinear)


@pytest.fixture(scope="module")
def led_by_centroid(make_model: ModelMaker) -> TextureModel:
    """One layer, so SC = f = 40 + 0.5·v, and everything else is linear in it."""
    centroid = plane(40, 0.5)
    return planted(
        make_model,
        noise=0.2 - 5e-4 * centroid,
        layers=[(centroid, 10 + 0.1 * centroid, -0.1 - 0.002 * centroid)],
    )


def assert_same(one, other, *, v: float, f: float) -> None:
    for a, b in zip(one.parameters(v, f), other.parameters(v, f), strict=True):
        assert a.shape == b.shape
        assert a == pytest.approx(b, rel=1e-9, abs=1e-12)


@settings(deadline=None, max_examples=200)
@given(v=ANY_SPEED, f=ANY_FORCE)
def test_a_linear_texture_needs_no_grid(bilinear, without_grid, v: float, f: float) -> None:
    """Equal inside, above, below and where speed or force is no number."""
    assert_same(without_grid, bilinear, v=v, f=f)


@pytest.mark.parametrize("v", [0.0, 25.0, -50.0, 200.0, 350.0, 900.0, np.nan])
@pytest.mark.parametrize("f", [-1.0, 0.0, 0.2, 0.5, 2.0, 9.0, np.inf])
def test_edges_are_those_of_the_grid(bilinear, led_by_centroid, v: float, f: float) -> None:
    assert_same(regressed(bilinear), bilinear, v=v, f=f)
    assert_same(regressed(led_by_centroid, by="centroid"), led_by_centroid, v=v, f=f)


def test_only_coefficients_that_are_needed_are_numbers(bilinear, led_by_centroid) -> None:
    assert regressed(bilinear).n_parameters == 24
    # Centroid 2; noise gain, frequency, bandwidth and amplitude 2 each (f = 0 + 1·SC, but the
    # intercept is what least squares leave of a zero).
    driven = regressed(led_by_centroid, by="centroid")
    assert driven.centroid_hz == pytest.approx([40, 0.5])
    assert driven.frequencies_hz[:, 0] == pytest.approx([0, 1], abs=1e-9)
    assert driven.amplitudes[:, 0] == pytest.approx([0.1, 0.002])
    assert driven.signs.tolist() == [-1]
    assert driven.n_parameters == 10
    assert driven.n_parameters < bilinear.n_parameters * 9


def test_it_knows_where_it_comes_from(bilinear) -> None:
    for by in ("conditions", "centroid"):
        driven = regressed(bilinear, by=by)
        assert (driven.texture, driven.rate_hz, driven.unit) == ("planted", 5000, "g")
        assert (driven.driven_by, driven.n_layers, driven.simulated) == (by, 2, True)
        assert driven.speeds_mm_s.tolist() == [50, 350]
        assert driven.forces_n.tolist() == [0.5, 3.5]


def test_force_does_nothing_where_the_centroid_drives(bilinear) -> None:
    driven = regressed(bilinear, by="centroid")
    weak, strong = driven.parameters([200.0, 80.0], 0.5), driven.parameters([200.0, 80.0], 3.5)
    for a, b in zip(weak, strong, strict=True):
        assert np.array_equal(a, b)


def test_a_centroid_that_rests_drives_nothing(make_model: ModelMaker) -> None:
    still = planted(make_model, noise=plane(0.1), layers=[(plane(100), plane(20), plane(1, 0.01))])
    driven = regressed(still, by="centroid")
    assert driven.centroid_hz == pytest.approx([100, 0])
    assert driven.peq(300.0, 1.0).gains == pytest.approx([np.mean(1 + 0.01 * SPEEDS)])
    # One number for the centroid, one for each of the four parameters.
    assert driven.n_parameters == 5


def test_neither_without_layers_nor_by_another_word(bilinear) -> None:
    bare = bilinear.with_layers([])
    assert regressed(bare).n_parameters == 4
    assert_same(regressed(bare), bare, v=200.0, f=2.0)
    with refused(InputError, names="planted", expected="layer", got="none"):
        regressed(bare, by="centroid")
    with refused(InputError, expected=["conditions", "centroid"], got="'speed'"):
        regressed(bilinear, by="speed")


@settings(deadline=None)
@given(v=st.floats(0, 400), f=st.floats(0, 5))
def test_gains_never_turn_round(v: float, f: float, make_falling: FallingMaker) -> None:
    at = make_falling().parameters(v, f)
    assert at.noise_gain >= 0
    assert at.gains <= 0
    if v >= 200:
        assert (at.noise_gain[0], at.gains[0, 0]) == (0, 0)


def test_what_leaves_the_legal_range_is_clamped(make_falling: FallingMaker) -> None:
    wild = make_falling(
        frequencies_hz=[[-500.0], [20.0], [0], [0]], bandwidths_hz=[[50.0], [-1], [0], [0]]
    )
    low, high = wild.peq(20.0, 1.0), wild.peq(350.0, 1.0)
    assert (low.frequencies_hz[0], high.frequencies_hz[0]) == (500, 2450)
    assert (low.bandwidths_hz[0], high.bandwidths_hz[0]) == (0.1, 0.1)
    renderer = Renderer(wild)
    assert np.isfinite(renderer.render(100.0, 1.0, samples=50)).all()
    assert renderer.counters.clamped == 10


@pytest.mark.parametrize("by", ["conditions", "centroid"])
def test_blocks_of_any_size_render_the_same_bits(bilinear, by: DrivenBy) -> None:
    driven = regressed(bilinear, by=by)
    speed, force = np.linspace(0, 400, 1500), np.linspace(4, 0, 1500)
    whole = Renderer(driven, seed=3).render(speed, force)
    for size in (1, 7, 256):
        renderer = Renderer(driven, seed=3)
        parts = [
            renderer.render(speed[i : i + size], force[i : i + size])
            for i in range(0, speed.size, size)
        ]
        assert np.array_equal(np.concatenate(parts), whole)


def test_it_renders_as_the_grid_does(bilinear) -> None:
    speed, force = np.linspace(0, 400, 3000), np.linspace(4, 0, 3000)
    one, other = (
        Renderer(m, rate_hz=8000.0, seed=3).render(speed, force)
        for m in (bilinear, regressed(bilinear))
    )
    assert other == pytest.approx(one, rel=1e-7, abs=1e-9)


def test_many_points_are_those_points_one_by_one(bilinear) -> None:
    speed, force = np.linspace(-400, 400, 41), np.linspace(0, 5, 41)
    for driven in (regressed(bilinear), regressed(bilinear, by="centroid")):
        together = driven.parameters(speed, force)
        for i in range(speed.size):
            for all_of_them, alone in zip(
                together, driven.parameters(speed[i], force[i]), strict=True
            ):
                assert np.array_equal(all_of_them[i], alone[0])


def test_files_load_back_equal(bilinear, tmp_path: Path) -> None:
    driven = [regressed(bilinear), regressed(bilinear, by="centroid")]
    driven.append(regressed(bilinear.with_layers([])))
    for number, one in enumerate(driven):
        path = tmp_path / "deep" / f"{number}.json"
        one.save(path)
        assert RegressedModel.load(path) == one
    assert driven[0] != driven[1]
    assert driven[0] != replace(driven[0], texture="other")
    assert driven[0] != bilinear


@pytest.mark.parametrize(
    ("change", "facts"),
    [
        ({"signs": [1, 0]}, ["signs", "−1"]),
        ({"signs": [1]}, ["signs", "layers"]),
        ({"noise_gain": [1, 2]}, "coefficients"),
        ({"driven_by": "centroid"}, ["noise_gain", 2]),
        ({"speeds_mm_s": [350, 50]}, ["speeds_mm_s", "rising", 0]),
        ({"forces_n": [1, 2, 3]}, ["forces_n", 2]),
        ({"centroid_hz": [1, 2]}, ["centroid_hz", 0]),
    ],
)
def test_arrays_that_do_not_fit_are_refused(
    bilinear, change: dict[str, object], facts: list[object]
) -> None:
    with refused(InputError, expected=facts):
        RegressedModel.read(regressed(bilinear).to_dict() | change)


def test_coefficients_cannot_be_changed(bilinear) -> None:
    with pytest.raises(ValueError, match="read-only"):
        regressed(bilinear).noise_gain[0] = 1
