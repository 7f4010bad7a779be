"""Loops and grains: what is played at rest, and that nothing jumps when the hand moves."""

from __future__ import annotations

import numpy as np
import pytest

from tactileq.benches.rendering.rivals import SoundStream, layered_texture
from tactileq.benches.rendering.stored_sounds import Grains, Loops, grains_of, make_loops
from tactileq.modeling import Recording
from tactileq.modeling.arrays import Floats
from tactileq.modeling.recordings.spectrum import prepare
from tactileq.modeling.similarity import log_spectral_distance_db
from tactileq.stimuli.planted.textures import planted_texture, record_texture

RATE_HZ = 5000.0
SPEEDS, FORCES = np.array([50.0, 150.0, 350.0]), np.array([0.5, 1.5, 3.5])
FREQUENCY_HZ = np.linspace(20.0, 2400.0, 400)


def response(speed: float, force: float, frequency: Floats) -> Floats:
    return layered_texture(3).peq(speed, force).response(frequency)


@pytest.fixture(scope="module")
def loops() -> Loops:
    rng = np.random.default_rng(0)
    return make_loops((SPEEDS, FORCES), response, rate_hz=RATE_HZ, seconds=1.0, rng=rng)


def played(loops: Loops, speed: float, force: float, samples: int) -> Floats:
    stream = SoundStream(loops, update_samples=5, seed=0)
    return stream.render(np.full(samples, speed), np.full(samples, force))


@pytest.mark.parametrize(
    ("speed", "force"), [(150.0, 1.5), (100.0, 2.5), (20.0, 0.25), (500.0, 9.0)]
)
def test_a_loop_has_the_spectrum_of_its_place_and_repeats(
    loops: Loops, speed: float, force: float
) -> None:
    sound = played(loops, speed, force, 10000)
    assert sound[5000:] == pytest.approx(sound[:5000], abs=1e-12)
    lines = np.abs(np.fft.rfft(sound[:5000])) / np.sqrt(5000)
    frequency = np.fft.rfftfreq(5000, 1 / RATE_HZ)
    expected = loops.filter(speed, force).response(frequency)
    assert lines[1:] == pytest.approx(expected[1:], abs=2e-4 * expected.max())


def test_at_a_node_it_is_the_magnitude_that_was_asked_for(loops: Loops) -> None:
    found = loops.filter(150.0, 1.5).response(FREQUENCY_HZ)
    assert log_spectral_distance_db(found, response(150.0, 1.5, FREQUENCY_HZ)) < 0.01


def test_between_nodes_magnitudes_blend(loops: Loops) -> None:
    corners = [response(v, f, FREQUENCY_HZ) for v in (50.0, 150.0) for f in (0.5, 1.5)]
    found = loops.filter(100.0, 1.0).response(FREQUENCY_HZ)
    assert log_spectral_distance_db(found, np.mean(corners, axis=0)) < 0.01


def test_from_cell_to_cell_nothing_jumps() -> None:
    """Of loops that hold one number all the same, so that the weights are heard alone."""
    constant = Loops(
        speeds_mm_s=SPEEDS,
        forces_n=FORCES,
        samples=np.ones((3, 3, 100), dtype=np.int16),
        scales=np.arange(9.0).reshape(3, 3),
        rate_hz=RATE_HZ,
    )
    time_s = np.arange(5000) / RATE_HZ
    speed, force = 400 * np.sin(2 * np.pi * 4 * time_s), 2 + 2 * np.sin(2 * np.pi * 3 * time_s)
    sound = SoundStream(constant, update_samples=5, seed=0).render(speed, force)
    # Within 5 samples the hand moves by 20 mm/s and 0.08 N at most: from 0 to 1 times 9 in 50 mm/s.
    assert np.abs(np.diff(sound)).max() < 0.1 * sound.max()
    assert sound.max() == pytest.approx(8, abs=0.5)
    assert np.abs(sound).min() < 0.5


def test_lift_off_is_silent(loops: Loops) -> None:
    assert played(loops, np.nan, 1.0, 100) == pytest.approx(0)
    assert played(loops, 100.0, -1.0, 100) == pytest.approx(0)
    assert played(loops, 0.0, 1.0, 100) == pytest.approx(0)


def test_grains_have_the_power_of_the_recordings_around() -> None:
    rng = np.random.default_rng(2)
    scales = np.array([1.0, 2.0, 4.0])[:, None] * np.array([1.0, 3.0, 5.0]) * 1e-4
    grains = Grains(
        speeds_mm_s=SPEEDS,
        forces_n=FORCES,
        samples=rng.integers(-9000, 9000, (3, 3, 5000)).astype(np.int16),
        scales=scales,
        rate_hz=RATE_HZ,
        block=256,
    )
    sound = SoundStream(grains, update_samples=5, seed=0).render(
        np.full(200_000, 100.0), np.full(200_000, 1.0)
    )
    power = np.mean(scales[:2, :2] ** 2) * 9000**2 / 3  # of uniform numbers
    # Some 5 % of scatter: 5,000 samples of four recordings.
    assert np.mean(sound**2) == pytest.approx(power, rel=0.08)
    frequency = np.linspace(0, RATE_HZ / 2, 2001)
    told = grains.filter(100.0, 1.0).response(frequency)
    assert np.mean(told**2) == pytest.approx(np.mean(sound**2), rel=0.03)


def recorded() -> list[Recording]:
    texture = planted_texture("canvas", rate_hz=RATE_HZ)
    return list(record_texture(texture, duration_s=1.0, seed=3).recordings)


def sound_at(grains: Grains, condition: tuple[float, float]) -> Floats:
    i = grains.speeds_mm_s.tolist().index(condition[0])
    j = grains.forces_n.tolist().index(condition[1])
    return grains.samples[i, j] * grains.scales[i, j]


def test_grains_are_of_the_recordings_and_holes_of_the_nearest() -> None:
    by_condition = {record.condition: [record] for record in recorded()}
    hole = sorted(by_condition)[len(by_condition) // 2]
    removed = by_condition.pop(hole)
    grains = grains_of(by_condition, texture="canvas", block=256)
    # The level is interpolated between neighbours.
    assert sound_at(grains, hole).std() == pytest.approx(prepare(removed[0]).std(), rel=0.3)
    kept = next(iter(by_condition))
    expected = prepare(by_condition[kept][0])[: grains.length]
    rounding = np.abs(expected).max() / 2**15
    assert np.abs(sound_at(grains, kept) - expected).max() < rounding


@pytest.mark.parametrize("block", [1, 7, 256])
def test_blocks_of_any_size_give_equal_bits(loops: Loops, block: int) -> None:
    rng = np.random.default_rng(4)
    grains = Grains(
        speeds_mm_s=SPEEDS,
        forces_n=FORCES,
        samples=rng.integers(-9000, 9000, (3, 3, 500)).astype(np.int16),
        scales=np.ones((3, 3)),
        rate_hz=RATE_HZ,
        block=64,
    )
    speed, force = np.linspace(-300, 300, 700), np.linspace(4, 0, 700)
    for sounds in (loops, grains):
        whole = SoundStream(sounds, update_samples=5, seed=1).render(speed, force)
        stream = SoundStream(sounds, update_samples=5, seed=1)
        pieces = [
            stream.render(speed[n : n + block].copy(), force[n : n + block].copy())
            for n in range(0, 700, block)
        ]
        assert np.array_equal(np.concatenate(pieces), whole)
