"""All-pole models in real time (`lattice.h`): against Python, SciPy and closed forms."""

from __future__ import annotations

import subprocess
from collections.abc import Sequence
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays
from scipy.signal import lfilter, welch

import tactileq.modeling.rendering
from tactileq.modeling import InputError, Limits, Recording, Renderer
from tactileq.modeling.arrays import Floats
from tactileq.modeling.fitting.autoregressive import HIGHEST_ORDER, fit_ar
from tactileq.modeling.models.ar_model import ARModel
from tactileq.modeling.rendering.lattice import lattice_fields
from tactileq.modeling.rendering.plan import plan_for
from tactileq.modeling.rendering.reference.compensator import Compensator
from tactileq.modeling.vibrators.compensation import Compensation
from tactileq.stimuli.planted.textures import planted_texture
from tests.modeling.rendering.lattices import (
    CompiledLattice,
    ar_model,
    in_python,
    planted_ar,
    poles,
)
from tests.refusals import refused

HERE = Path(__file__).parent
CARD_HZ = 48000.0
RATES_HZ = [(5000.0, 48000.0), (5000.0, 44100.0), (2000.0, 48000.0), (44100.0, 48000.0)]


def hands(count: int, *, seed: int = 0, every: int = 1) -> tuple[Floats, Floats]:
    """Speeds and forces within and around the grid, each held for some samples."""
    rng = np.random.default_rng(seed)
    readings = -(-count // every)
    speeds, forces = rng.uniform(-400, 400, readings), rng.uniform(0, 4, readings)
    return np.repeat(speeds, every)[:count], np.repeat(forces, every)[:count]


@st.composite
def any_model(draw: st.DrawFn, *, closest: float) -> ARModel:
    """Filters that have nothing to do with each other; `closest`: smallest gap to the largest."""
    order, shape = draw(st.integers(1, 12)), draw(st.sampled_from([(1, 1), (2, 1), (3, 2)]))
    gaps = draw(arrays(np.float64, (*shape, order + 1), elements=st.floats(closest, 1.0)))
    rising = np.cumsum(gaps, axis=-1)
    return ARModel(
        texture="any",
        rate_hz=5000.0,
        speeds_mm_s=np.linspace(50.0, 350.0, shape[0]),
        forces_n=np.linspace(0.5, 3.5, shape[1]),
        line_spectral_frequencies=np.pi * rising[..., :-1] / rising[..., -1:],
        gains=draw(arrays(np.float64, shape, elements=st.floats(0, 1e6))),
        level_sd_db=np.zeros(shape),
    )


# --- The filter -----------------------------------------------------------------------------------


@given(any_model(closest=0.2), st.integers(0, 2**32))
@settings(max_examples=60, deadline=None)
def test_at_the_models_rate_it_is_the_python_lattice(model: ARModel, seed: int) -> None:
    speeds, forces = hands(400, seed=seed, every=3)
    wanted = Renderer(model, seed=seed).render(speeds, forces)
    played = CompiledLattice(model, rate_hz=5000.0, seed=seed).blocks(speeds, forces, block=1)
    np.testing.assert_allclose(played, wanted, rtol=0, atol=1e-10 * np.abs(wanted).max())


@pytest.mark.parametrize("order", [1, 2, 7, 20, HIGHEST_ORDER])
def test_fitted_models_of_all_orders_are_those_of_python(order: int) -> None:
    made = planted_texture("canvas")
    records = [
        Recording(Renderer(made, seed=n).render(v, f, samples=5000), 5000.0, v, f, "canvas")
        for n, (v, f) in enumerate([(50.0, 0.5), (350.0, 0.5), (50.0, 3.5), (350.0, 3.5)])
    ]
    model = fit_ar(records, order=order)
    speeds, forces = hands(3000, every=7)
    wanted = Renderer(model).render(speeds, forces)
    played = CompiledLattice(model, rate_hz=5000.0).blocks(speeds, forces, block=1)
    np.testing.assert_allclose(played, wanted, rtol=0, atol=1e-12 * np.abs(wanted).max())


def test_a_stroke_over_the_whole_grid_is_followed_as_in_python() -> None:
    """Where the hand is extrapolated, also from one cell of the grid to the next."""
    conditions = [(poles((0.97, 0.05 + 0.1 * n), (0.8, 2.0)), 0.1 + n / 10) for n in range(9)]
    model = ar_model(*conditions, shape=(3, 3))
    time_s = np.arange(10_000) / 5000
    speeds = 380 * np.sin(2 * np.pi * 2 * time_s)
    forces = 2 + 2 * np.sin(2 * np.pi * 3.1 * time_s)
    wanted = Renderer(model).render(speeds, forces)
    played = CompiledLattice(model, rate_hz=5000.0).blocks(speeds, forces, block=1)
    np.testing.assert_allclose(played, wanted, rtol=0, atol=1e-11 * np.abs(wanted).max())


def test_filters_on_the_brink_are_finite_and_leave_nothing_behind() -> None:
    """Neighbouring numbers as line spectral frequencies: a coefficient of 1, none below it."""
    for place in np.linspace(0.1, 3.0, 100):
        close = [place, np.nextafter(place, 4)]
        model = ARModel(
            texture="brink",
            rate_hz=5000.0,
            speeds_mm_s=[50.0, 350.0],
            forces_n=[1.0],
            line_spectral_frequencies=[[close], [[0.5, 1.0]]],
            gains=[[1e-9], [0.1]],
            level_sd_db=[[0.0], [0.0]],
        )
        lattice = CompiledLattice(model, rate_hz=5000.0, limits=Limits(peak=1.0))
        assert np.isfinite(lattice.held(50.0, 1.0, samples=500)).all()
        assert np.isfinite(lattice.states).all()
        after = lattice.held(350.0, 1.0, samples=500)
        assert after[100:].std() > 0.05


@pytest.mark.parametrize("rates_hz", [*RATES_HZ, (10000.0, 48000.0), (3000.0, 48000.0)])
def test_at_the_cards_rate_it_is_the_python_lattice(
    rates_hz: tuple[float, float],
) -> None:
    model = planted_ar(rate_hz=rates_hz[0])
    speeds, forces = hands(6400, every=64)
    wanted = in_python(model, speeds, forces, rate_hz=rates_hz[1])
    lattice = CompiledLattice(model, rate_hz=rates_hz[1])
    played = lattice.blocks(speeds[::64], forces[::64], block=64)
    np.testing.assert_allclose(played, wanted, rtol=0, atol=1e-12 * np.abs(wanted).max())


@pytest.mark.parametrize("block", [1, 7, 64, 65, 1000])
def test_blocks_of_any_size_have_equal_bits(block: int) -> None:
    model = planted_ar()
    whole, parts = (CompiledLattice(model, rate_hz=CARD_HZ) for _ in range(2))
    played = np.concatenate(
        [parts.held(150.0, 1.5, samples=min(block, 3000 - n)) for n in range(0, 3000, block)]
    )
    np.testing.assert_array_equal(played, whole.held(150.0, 1.5, samples=3000))


def test_memory_of_just_its_size_is_enough(tmp_path: Path) -> None:
    headers = Path(tactileq.modeling.rendering.__file__).parent
    options = ["-std=c11", "-Wall", "-Wextra", "-Wpedantic", "-Werror", "-Wno-unused-function"]
    watched = ["-g", "-fsanitize=address,undefined", "-fno-sanitize-recover=all"]
    target = tmp_path / "memory"
    source = str(HERE / "lattice_memory.c")
    command = ["gcc", *options, *watched, f"-I{headers}", source, "-o", str(target), "-lm"]
    subprocess.run(command, check=True)
    run = subprocess.run([target], capture_output=True, text=True)
    assert run.returncode == 0, run.stderr
    assert np.isfinite(float(run.stdout))


# --- Spectra --------------------------------------------------------------------------------------


@pytest.mark.parametrize("rates_hz", RATES_HZ[:3])
def test_the_spectrum_is_the_filters_and_no_image_is_louder_than_60_db_below_it(
    rates_hz: tuple[float, float],
) -> None:
    own_hz, card_hz = rates_hz
    model = planted_ar(rate_hz=own_hz)
    played = CompiledLattice(model, rate_hz=card_hz).held(150.0, 1.5, samples=int(20 * card_hz))
    points = int(card_hz / own_hz * 512)
    frequency, density = welch(played[1000:], card_hz, window="blackmanharris", nperseg=points)
    wanted = model.filter(150.0, 1.5).response(np.minimum(frequency, own_hz / 2)) ** 2 * 2 / own_hz
    flat = (frequency > 0.02 * own_hz) & (frequency < 0.45 * own_hz)
    for which in np.array_split(np.flatnonzero(flat), 12):
        ratio_db = 10 * np.log10(density[which].sum() / wanted[which].sum())
        assert abs(ratio_db) < 0.25
    image = frequency >= 0.55 * own_hz
    # An image of each frequency is 60 dB below what it is the image of.
    folded = np.abs((frequency + own_hz / 2) % own_hz - own_hz / 2)
    of = model.filter(150.0, 1.5).response(folded) ** 2 * 2 / own_hz
    parts = np.array_split(np.flatnonzero(image), 20)
    assert max(density[part].sum() / of[part].sum() for part in parts) < 1e-6


def test_compensation_is_that_of_python_at_the_cards_rate() -> None:
    model = planted_ar()
    undone = Compensation(frequency_hz=150.0, bandwidth_hz=80.0, height=4.0, rate_hz=CARD_HZ)
    speeds, forces = hands(4000, every=100)
    plain = in_python(model, speeds, forces, rate_hz=CARD_HZ)
    plan = plan_for(5000.0, rate_hz=CARD_HZ, compensation=undone)
    wanted = np.array(Compensator(plan).filter(plain.tolist()))
    lattice = CompiledLattice(model, rate_hz=CARD_HZ, compensation=undone)
    played = lattice.blocks(speeds[::100], forces[::100], block=100)
    assert np.abs(wanted - plain).max() > 0.1 * np.abs(plain).max()
    np.testing.assert_allclose(played, wanted, rtol=0, atol=1e-12 * np.abs(wanted).max())


# --- Whatever the hand does -----------------------------------------------------------------------

ODD = st.floats(width=64) | st.floats(-500, 500) | st.sampled_from([0.0, 5e-324, 50.0, 0.5])


@given(
    any_model(closest=1e-9),
    st.lists(st.tuples(ODD, ODD, st.integers(1, 700)), min_size=1, max_size=30),
)
@settings(max_examples=100, deadline=None)
def test_limits_hold_for_every_model_and_hand(
    model: ARModel, blocks: Sequence[tuple[float, float, int]]
) -> None:
    limits = Limits(
        peak=0.4, rms=0.1, rms_window_s=0.05, duration_s=0.1, pause_s=0.01, silence=1e-3
    )
    lattice = CompiledLattice(model, rate_hz=CARD_HZ, limits=limits)
    played = np.concatenate([lattice.held(v, f, samples=count) for v, f, count in blocks])
    assert np.isfinite(played).all()
    assert np.abs(played).max() <= 0.4
    share = -np.expm1(-1 / (0.05 * CARD_HZ))
    mean_square = lfilter([share], [1, share - 1], played**2)
    assert np.sqrt(mean_square.max()) <= 0.1 * (1 + 1e-9)
    loud = np.flatnonzero(np.abs(played) > 1e-3)
    strokes = np.split(loud, np.flatnonzero(np.diff(loud) > 0.01 * CARD_HZ) + 1)
    assert max(s[-1] - s[0] + 1 if s.size else 0 for s in strokes) <= 0.1 * CARD_HZ
    lift_offs = sum(n for v, f, n in blocks if not (np.isfinite(v) and np.isfinite(f)))
    assert lattice.counters.lift_offs == lift_offs


def test_jumps_of_the_filter_from_update_to_update_do_not_make_it_grow() -> None:
    """A direct form of the same filters grows without bound; here the states keep unit variance."""
    narrow = [0.05, 3.0, 1.2, 0.3]
    model = ar_model(
        *((poles((0.999, angle), (0.998, angle + 0.05), (0.99, 0.7)), 0.01) for angle in narrow)
    )
    lattice = CompiledLattice(model, rate_hz=5000.0)
    rng = np.random.default_rng(2)
    speeds, forces = rng.choice([50.0, 350.0], 4000), rng.choice([0.5, 3.5], 4000)
    squares = np.zeros(6)
    for speed, force in zip(speeds, forces, strict=True):
        lattice.held(speed, force, samples=5)
        squares += lattice.states**2
    np.testing.assert_allclose(np.sqrt(squares / 4000), 1.0, atol=0.1)


def test_steps_of_the_hand_bring_nothing_above_the_models_band() -> None:
    model = planted_ar()
    lattice = CompiledLattice(model, rate_hz=CARD_HZ)
    speeds = np.tile([60.0, 340.0, 0.0], 200)
    played = lattice.blocks(speeds, np.tile([0.6, 3.4], 300), block=480)
    frequency, density = welch(played, CARD_HZ, window="blackmanharris", nperseg=8192)
    above = frequency > 2750
    assert density[above].sum() < 1e-6 * density[~above].sum()


@pytest.mark.parametrize(("speed_mm_s", "force_n"), [(0.0, 1.5), (150.0, 0.0), (np.nan, 1.5)])
def test_lift_off_and_rest_end_in_exact_zeros(speed_mm_s: float, force_n: float) -> None:
    lattice = CompiledLattice(planted_ar(), rate_hz=CARD_HZ)
    before = lattice.held(150.0, 1.5, samples=4800)
    after = lattice.held(speed_mm_s, force_n, samples=4800)
    # Contact ends after 3 ms, a missing hand is held for 20; to the next update each.
    held = 0.021 if np.isnan(speed_mm_s) else 0.004 if force_n == 0 else 0.0
    # The gain falls within an update and 5 ms; 37 samples of the model are interpolated.
    tail = int(CARD_HZ * (held + 0.001 + 0.005 + 37 / 5000))
    # What is heard is gone sooner.
    heard = np.flatnonzero(np.abs(after) > 0.01 * before.std())
    assert heard[-1] < CARD_HZ * (held + 0.015)
    assert before.all()
    assert not after[tail:].any()
    assert lattice.counters.lift_offs == (4800 if np.isnan(speed_mm_s) else 0)


def stroke(time_s: Floats) -> tuple[Floats, Floats]:
    """From rest to 300 mm/s and back, within the grid's forces."""
    return 300 * np.sin(4 * np.pi * time_s), 1.5 + np.sin(2 * np.pi * time_s)


def test_readings_at_times_of_their_own_are_those_of_python() -> None:
    lattice, python = CompiledLattice(planted_ar(), rate_hz=5000.0), Renderer(planted_ar())
    rng = np.random.default_rng(0)
    for samples in rng.integers(0, 12, 100).tolist():
        reading, ago = rng.uniform((-300, -1), (300, 3)).tolist(), rng.uniform(0, 5)
        lattice.read(*reading, ago=ago)
        python.read(*reading, ago=ago)
        assert lattice.on(samples) == pytest.approx(python.render_on(samples), abs=1e-12)
    assert lattice.counters == python.counters


def test_readings_late_by_up_to_a_millisecond_are_within_6_db_of_the_hand_at_every_sample() -> None:
    """At the card's rate, against Python with updates at each of the model's samples."""
    count, rng = 24000, np.random.default_rng(1)
    hand = stroke(np.arange(count) / CARD_HZ)
    exact = in_python(planted_ar(), *hand, rate_hz=CARD_HZ, update_samples=1)
    locked = in_python(planted_ar(), *hand, rate_hz=CARD_HZ)
    lattice = CompiledLattice(planted_ar(), rate_hz=CARD_HZ)
    times_s = (np.arange(0, count, 48) + rng.uniform(0, 48, count // 48)) / CARD_HZ
    parts, done = [], 0
    for time_s, speed, force in zip(times_s, *stroke(times_s), strict=True):
        now = min(int(np.ceil(time_s * CARD_HZ)), count)
        parts.append(lattice.on(now - done))
        lattice.read(speed, force, ago=now - time_s * CARD_HZ)
        done = now
    read = np.concatenate([*parts, lattice.on(count - done)])
    off, at_updates = (np.mean((of - exact) ** 2) for of in (read, locked))
    assert 10 * np.log10(off / at_updates) <= 6


def test_a_hand_outside_the_grid_is_counted_at_every_sample() -> None:
    lattice = CompiledLattice(planted_ar(), rate_hz=CARD_HZ)
    lattice.held(400.0, 1.5, samples=4800)
    lattice.held(20.0, 1.5, samples=4800)
    counted = lattice.counters
    late = CARD_HZ * 0.001 + 10  # until the next update
    assert 0 <= counted.above_grid - 4800 <= late
    assert 0 <= 4800 - counted.below_grid <= late
    assert counted.clamped == 0


# --- Refusals -------------------------------------------------------------------------------------


def test_what_no_callback_can_play_is_refused_in_a_sentence() -> None:
    frequencies = np.linspace(0, np.pi, 103)[1:-1].reshape(1, 1, -1)
    model = ARModel(
        texture="too much",
        rate_hz=5000.0,
        speeds_mm_s=[100.0],
        forces_n=[1.0],
        line_spectral_frequencies=frequencies,
        gains=[[1.0]],
        level_sd_db=[[0.0]],
    )
    with refused(InputError, expected=["AR", 100], got=[101, "too much"]):
        lattice_fields(model, plan_for(5000.0, rate_hz=CARD_HZ))
