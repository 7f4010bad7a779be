"""What `Renderer.render` takes and gives: arrays or numbers, new arrays or the caller's."""

from __future__ import annotations

from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace
from threading import Event
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.signal import lfilter

from tactileq.modeling import ARModel, InputError, Limits, Renderer
from tactileq.modeling.engines import SWITCH
from tactileq.modeling.errors import shown
from tactileq.modeling.rendering.compiled import Call
from tactileq.stimuli.planted.textures import planted_texture
from tests.refusals import refused

CANVAS = planted_texture("canvas")
compiled_only = pytest.mark.skipif(Call is None, reason="no kernel was compiled")
Make = Callable[[], Renderer]
COUNT = 700  # more than what is converted from one precision to the other at a time


def stroke(count: int = COUNT) -> tuple[np.ndarray, np.ndarray]:
    at = np.arange(count) / 5000
    speed, force = 300 * np.sin(2 * np.pi * 5 * at), 1.5 + np.cos(2 * np.pi * 3 * at)
    speed[50:60] = np.nan
    return speed, force


def oak() -> ARModel:
    return ARModel(
        texture="oak",
        rate_hz=5000.0,
        speeds_mm_s=[100.0, 200.0],
        forces_n=[1.0, 2.0],
        line_spectral_frequencies=np.full((2, 2, 2), [1.0, 2.0]),
        gains=np.ones((2, 2)),
        level_sd_db=np.zeros((2, 2)),
    )


@pytest.fixture(params=["compiled", "Python", "autoregressive"])
def make(request: pytest.FixtureRequest, monkeypatch: pytest.MonkeyPatch) -> Make:
    """A renderer of each kind."""
    if request.param == "Python":
        monkeypatch.setenv(SWITCH, "1")
    elif request.param == "compiled" and Call is None:
        pytest.skip("no kernel was compiled")
    return lambda: Renderer(oak() if request.param == "autoregressive" else CANVAS, seed=3)


@pytest.mark.parametrize("dtype", [np.float64, np.float32])
def test_the_callers_array_gets_what_a_new_one_would(make: Make, dtype: type) -> None:
    expected = make().render(*stroke())
    out = np.full(COUNT, 7, dtype=dtype)
    assert make().render(*stroke(), out=out) is out
    assert np.array_equal(out, expected.astype(dtype))
    assert expected.dtype == np.float64


@pytest.mark.parametrize("dtype", [np.float64, np.float32])
def test_two_numbers_are_a_hand_that_is_held(make: Make, dtype: type) -> None:
    expected = make().render(np.full(COUNT, 120.0), np.full(COUNT, 1.1))
    assert np.array_equal(make().render(120.0, 1.1, samples=COUNT), expected)
    assert np.array_equal(make().render(np.float64(120), np.array(1.1), samples=COUNT), expected)
    out = np.empty(COUNT, dtype=dtype)
    assert make().render(120, 1.1, out=out) is out
    assert np.array_equal(out, expected.astype(dtype))
    assert make().render(120.0, 1.1, samples=COUNT, out=out) is out
    assert np.array_equal(out, expected.astype(dtype))


def test_hands_of_any_kind_of_number_are_converted(make: Make) -> None:
    expected = make().render(np.full(40, 120.0), np.full(40, 1.0))
    out = np.empty(40)
    for speed, force in (
        ([120] * 40, (1.0,) * 40),
        (np.full(40, 120, dtype=np.int16), np.ones(40, dtype=np.float32)),
        (np.full((40, 2), 120.0)[:, 0], np.ones(80)[::-2]),
    ):
        assert make().render(speed, force, out=out) is out
        assert np.array_equal(out, expected)


@settings(max_examples=40, deadline=None)
@given(st.lists(st.tuples(st.integers(0, 300), st.sampled_from("nsfdh")), max_size=6))
def test_a_stream_goes_on_however_it_is_called(calls: list[tuple[int, str]]) -> None:
    """New arrays, numbers, float32 and float64 of the caller's, in any order."""
    total = sum(count for count, _ in calls)
    expected = Renderer(CANVAS, seed=3).render(150.0, 1.5, samples=total)
    renderer, done = Renderer(CANVAS, seed=3), 0
    for count, how in calls:
        hand = np.full(count, 150.0), np.full(count, 1.5)
        if how == "n":
            found = renderer.render(*hand)
        elif how == "s":
            found = renderer.render(150.0, 1.5, samples=count)
        elif how == "h":
            found = renderer.render(150.0, 1.5, out=np.empty(count))
        else:
            dtype = np.float32 if how == "f" else np.float64
            found = renderer.render(*hand, out=np.empty(count, dtype=dtype))
        wanted = expected[done : done + count]
        assert np.array_equal(found, wanted.astype(found.dtype))
        done += count


READ_ONLY = np.zeros(5)
READ_ONLY.flags.writeable = False


@pytest.mark.parametrize(
    ("out", "got"),
    [
        (np.zeros(5, dtype=int), ["int64", "(5,)"]),
        (np.zeros(4), ["float64", "(4,)"]),
        (np.zeros((5, 1)), ["float64", "(5, 1)"]),
        (np.zeros(10)[::2], ["float64", "(5,)"]),
        (READ_ONLY, ["float64", "(5,)", "np.empty(5)"]),
        (np.zeros(5, dtype=">f8"), ">f8"),
        ([0.0] * 5, "[0.0, 0.0, 0.0, 0.0, 0.0]"),
    ],
)
def test_another_array_is_refused_and_nothing_rendered(make: Make, out: Any, got: object) -> None:
    renderer = make()
    facts = {"expected": ["out", "writable", "contiguous", 5, "float64", "float32"], "got": got}
    with refused(InputError, **facts):
        renderer.render(np.full(5, 120.0), np.full(5, 1.0), out=out)
    with refused(InputError, **facts):
        renderer.render(120.0, 1.0, samples=5, out=out)
    assert np.array_equal(
        renderer.render(120.0, 1.0, samples=50), make().render(120.0, 1.0, samples=50)
    )


@pytest.mark.parametrize("samples", [-1, 2.5, 10**30, "5"])
def test_other_numbers_of_samples_are_refused(make: Make, samples: Any) -> None:
    with refused(InputError, expected=["samples", 0, 2147483648], got=shown(samples)):
        make().render(120.0, 1.0, samples=samples)


@pytest.mark.parametrize("speed", ["fast", 10**400], ids=["text", "too large"])
def test_a_hand_of_text_or_beyond_any_number_is_refused(make: Make, speed: Any) -> None:
    with refused(InputError, expected=["speed", "force"], got=shown(speed)):
        make().render(speed, 1.0, samples=5)


@pytest.mark.parametrize("dtype", [np.float64, np.float32])
@pytest.mark.parametrize("which", [0, 1])
@pytest.mark.parametrize("ahead", [-3, 0, 3, 70])
def test_a_hand_is_read_before_it_is_overwritten(
    make: Make, dtype: type, which: int, ahead: int
) -> None:
    """The caller's array may be that of the speeds or forces, or part of it."""
    hand = list(stroke())
    expected = make().render(*hand).astype(dtype)
    memory = np.zeros(COUNT + 100)
    shared = memory[10 : 10 + COUNT]
    shared[:] = hand[which]
    hand[which] = shared
    out = memory[10 + ahead :].view(dtype)[:COUNT]
    assert np.array_equal(make().render(*hand, out=out), expected)


@compiled_only
def test_streams_render_at_once_in_threads() -> None:
    """Long calls let other threads run meanwhile."""
    hand = stroke(50_000)
    expected = [Renderer(CANVAS, seed=seed).render(*hand) for seed in range(6)]
    with ThreadPoolExecutor(3) as pool:
        found = pool.map(lambda seed: Renderer(CANVAS, seed=seed).render(*hand), range(6))
        assert all(map(np.array_equal, found, expected))


@compiled_only
def test_one_renderer_in_two_threads_at_once_is_refused() -> None:
    """Both would write to one state, and beyond the caller's arrays."""
    renderer, stopped = Renderer(CANVAS), Event()

    def long_calls() -> None:
        while not stopped.is_set():
            renderer.render(150.0, 1.5, samples=200_000)

    def short_calls() -> None:
        while not other.done():
            renderer.render(150.0, 1.5, samples=1)

    with ThreadPoolExecutor(1) as pool:
        other = pool.submit(long_calls)
        try:
            with refused(RuntimeError, expected="one", got=["two", "threads"]):
                short_calls()
        finally:
            stopped.set()
        other.result()
    assert renderer.render(150.0, 1.5, samples=1).shape == (1,)


# --- Single precision


@compiled_only
@pytest.mark.parametrize("rate_hz", [5000.0, 48_000.0])
def test_single_precision_differs_by_rounding_only(rate_hz: float) -> None:
    hand = stroke()
    double = Renderer(CANVAS, rate_hz=rate_hz, seed=3).render(*hand)
    renderer = Renderer(CANVAS, rate_hz=rate_hz, seed=3, single=True)
    found = renderer.render(*hand)
    assert found.dtype == np.float64
    assert np.array_equal(found, found.astype(np.float32))
    assert 0 < np.abs(found - double).max() < 1e-5 * np.abs(double).max()
    assert renderer.counters.lift_offs == 10


@compiled_only
@settings(max_examples=30, deadline=None)
@given(st.lists(st.integers(0, 300), max_size=6))
def test_single_precision_gives_the_same_bits_in_any_blocks(sizes: list[int]) -> None:
    speed, force = stroke(sum(sizes))
    limits = Limits(peak=0.3, rms=0.1, duration_s=0.05)
    expected = Renderer(CANVAS, limits=limits, single=True).render(speed, force)
    renderer, done = Renderer(CANVAS, limits=limits, single=True), 0
    for number, size in enumerate(sizes):
        out = np.empty(size, dtype=(np.float32, np.float64)[number % 2])
        part = slice(done, done + size)
        assert np.array_equal(renderer.render(speed[part], force[part], out=out), expected[part])
        done += size


@compiled_only
def test_single_precision_holds_a_hand_as_arrays_do() -> None:
    renderers = [Renderer(CANVAS, seed=1, single=True) for _ in range(2)]
    by_number = renderers[0].render(123.4, 1.1, samples=COUNT)
    assert np.array_equal(
        by_number, renderers[1].render(np.full(COUNT, 123.4), np.full(COUNT, 1.1))
    )


@compiled_only
@pytest.mark.parametrize(
    ("rms", "window_s"), [(1e-3, 1.0), (9.238642740866005e-07, 40.0), (1e-6, 10.0)]
)
def test_single_precision_stays_a_number_in_a_long_window(rms: float, window_s: float) -> None:
    """Where rounding lifts the running mean square above its limit."""
    limits = Limits(rms=rms, rms_window_s=window_s)
    rendered = Renderer(CANVAS, limits=limits, single=True).render(300.0, 3.0, samples=5000)
    assert np.isfinite(rendered).all()
    assert rendered.any()


def test_single_precision_is_refused_where_there_is_none(monkeypatch: pytest.MonkeyPatch) -> None:
    facts = {"expected": ["layered", "kernel", "single precision"], "got": "autoregressive"}
    with refused(InputError, **facts):
        Renderer(oak(), single=True)
    monkeypatch.setenv(SWITCH, "1")
    with refused(InputError, expected=facts["expected"], got="no kernel"):
        Renderer(CANVAS, single=True)


@compiled_only
def test_numbers_that_single_precision_cannot_hold_are_refused() -> None:
    with refused(InputError, expected="single precision", got="mean_square"):
        Renderer(CANVAS, limits=Limits(rms=1e-30), single=True)
    close = planted_texture("PVC", speeds_mm_s=np.array([100.0, 100.0 + 1e-9]))
    with refused(InputError, expected="single precision", got="speed_mm_s"):
        Renderer(close, single=True)


def weighted_rms(samples: np.ndarray, window_s: float, rate_hz: float) -> np.ndarray:
    """At each sample, weighted by exp(−age/window)."""
    share = -np.expm1(-1 / (window_s * rate_hz))
    return np.sqrt(lfilter([share], [1, share - 1], samples**2))


@compiled_only
@pytest.mark.parametrize("window_s", [0.01, 1.0, 10.0, 40.0])
def test_single_precision_keeps_the_limit_of_the_rms(window_s: float) -> None:
    """Nor does it stay further below than the rounding of the window's samples calls for."""
    rms = 0.03
    limits = Limits(rms=rms, rms_window_s=window_s)
    renderer = Renderer(CANVAS, seed=1, limits=limits, single=True)
    seconds = 3 * max(window_s, 1.0)
    samples = renderer.render(200.0, 2.0, samples=round(5000 * seconds))
    found = weighted_rms(samples, window_s, 5000.0).max()
    assert renderer.counters.limited_rms > 0
    assert rms * (1 - 1e-4 - 2.5e-7 * 5000 * window_s) < found <= rms


@compiled_only
@pytest.mark.parametrize("rate_hz", [5000.0, 48_000.0])
def test_single_precision_refuses_a_window_that_it_cannot_keep(rate_hz: float) -> None:
    limits = Limits(rms=0.1, rms_window_s=60.0)
    longest = {5000.0: "41.9", 48_000.0: "4.37"}[rate_hz]
    with refused(InputError, expected=["RMS", f"{longest} s", f"{rate_hz:g} Hz"], got=60):
        Renderer(CANVAS, rate_hz=rate_hz, limits=limits, single=True)
    Renderer(CANVAS, rate_hz=rate_hz, limits=limits)


@pytest.mark.parametrize("scale", [1e-10, 1.0, 1e4])
def test_grids_of_any_size_sound_the_same(make: Make, scale: float) -> None:
    """Nothing counts as rest that is on the grid, in whatever unit."""
    scaled = replace(CANVAS, forces_n=CANVAS.forces_n * scale)
    speed, force = stroke()
    found = Renderer(scaled, seed=3).render(speed, force * scale)
    assert found.std() > 0.01
    if scale < 1:  # steps of a hand are a fixed number of newtons
        assert found == pytest.approx(Renderer(CANVAS, seed=3).render(speed, force), abs=1e-9)
