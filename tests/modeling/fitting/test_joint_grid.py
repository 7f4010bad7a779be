"""The `joint` estimator over whole grids of planted conditions: names, signs, holes, order."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
import pytest

from tactileq.modeling import PEQ, Recording, RecordingSet
from tactileq.modeling.arrays import Floats
from tactileq.modeling.equalizer.bands import band_response
from tactileq.modeling.fitting.conditions import recording_spectra
from tactileq.modeling.fitting.joint_grid import GridFit, fit_grid_jointly
from tactileq.modeling.fitting.texture import fit_spectra
from tactileq.modeling.models.grid import Condition
from tactileq.modeling.models.own_peaks import own_peaks
from tactileq.modeling.recordings.spectrum import Spectrum, spectrum_of_samples

RATE_HZ = 5000.0
SAMPLES = 5000
Truth = Callable[[float, float], PEQ | None]


def planted(*layers: tuple[float, float, float], noise_gain: float = 0.02) -> PEQ:
    frequency, bandwidth, gain = np.array(layers, dtype=float).reshape(-1, 3).T
    return PEQ(
        noise_gain=noise_gain,
        frequencies_hz=frequency,
        bandwidths_hz=bandwidth,
        gains=gain,
        rate_hz=RATE_HZ,
    )


def draw(peq: PEQ | None, rng: np.random.Generator, *, independent: bool = False) -> Floats:
    """1 s of one noise through all bands, or of a noise of its own through each; or silence."""
    if peq is None:
        return np.zeros(SAMPLES)
    frequency = np.fft.rfftfreq(4 * SAMPLES, 1 / RATE_HZ)
    branches = peq.complex_response(frequency)[None, :]
    if independent:
        bands = band_response(
            frequency,
            centres_hz=peq.frequencies_hz,
            bandwidths_hz=peq.bandwidths_hz,
            rate_hz=RATE_HZ,
        )
        floor = np.full((1, frequency.size), peq.noise_gain, dtype=complex)
        branches = np.concatenate((floor, peq.gains[:, None] * bands))
    noise = np.fft.rfft(rng.standard_normal((len(branches), 4 * SAMPLES)))
    samples: Floats = np.fft.irfft((noise * branches).sum(axis=0), 4 * SAMPLES)[:SAMPLES]
    return samples


def axes(speeds: int, forces: int) -> list[Condition]:
    return [
        (float(v), float(f))
        for v in np.linspace(50, 350, speeds)
        for f in np.linspace(0.5, 3.5, forces)
    ]


def spectra(truth: Truth, grid: list[Condition], *, seed: int = 0) -> dict[Condition, Spectrum]:
    rng = np.random.default_rng(seed)
    return {c: spectrum_of_samples(draw(truth(*c), rng), RATE_HZ) for c in grid}


def table(found: GridFit, name: str, grid: list[Condition]) -> Floats:
    """A quantity of every layer in every condition, (C, m); every condition is a legal PEQ."""
    for layers in found.layers.values():
        PEQ(
            noise_gain=layers.noise_gain,
            frequencies_hz=layers.frequencies_hz,
            bandwidths_hz=layers.bandwidths_hz,
            gains=layers.gains,
            rate_hz=RATE_HZ,
        )
    return np.array([getattr(found.layers[c], name) for c in grid])


# --- names


@dataclass(frozen=True)
class Names:
    """Over all layers and conditions of some grids."""

    kept: int
    found: int
    layers: int
    false_layers: int
    planted_found: int
    planted: int


def names_kept(true_hz: Floats, true_width_hz: Floats, *, found_hz: Floats) -> Names:
    """How far (C, k) found layers are the same planted ones (C, m) in every condition.

    A found layer is the planted one that it is nearest to in the median, by half-widths (10 Hz at
    least); it keeps that name where it is within one of it, or no other planted one is nearer.
    """
    tolerance = np.maximum(true_width_hz / 2, 10.0)
    distance = np.abs(found_hz[:, :, None] - true_hz[:, None, :]) / tolerance[:, None, :]
    kept = found = false_layers = 0
    taken = set()
    for own in np.moveaxis(distance, 1, 0):
        name = int(np.median(own, axis=0).argmin())
        there = own[:, name] <= 1
        if there.mean() <= 0.5 or name in taken:
            false_layers += 1
            continue
        taken.add(name)
        kept += int((there | (own.argmin(axis=1) == name)).sum())
        found += there.size
    near = (distance.min(axis=1) <= 1).sum() if found_hz.size else 0
    return Names(kept, found, found_hz.shape[1], false_layers, int(near), true_hz.size)


def random_texture(rng: np.random.Generator) -> Truth:
    """One to five layers, 10–30 dB above the noise, each with a law of its own."""
    m = int(rng.integers(1, 6))
    frequency = np.sort(rng.uniform(40, 1300, m))
    by_speed = rng.choice([0.0, 0.05, 0.1, 0.3, 1.0], m)
    by_speed = np.where(frequency < 250, by_speed, np.minimum(by_speed, 0.3))
    by_force = rng.uniform(-0.05, 0.05, m)
    width = np.minimum(np.exp(rng.uniform(np.log(10), np.log(200), m)), frequency)
    level_db = rng.uniform(10, 30, m)
    louder, harder = rng.uniform(0, 0.6, m), rng.uniform(0, 0.3, m)

    def at(speed_mm_s: float, force_n: float) -> PEQ:
        v, f = speed_mm_s / 200, force_n / 2
        gain = 0.02 * 10 ** (level_db / 20) * v**louder * f**harder
        return planted(*zip(frequency * v**by_speed * f**by_force, width, gain, strict=True))

    return at


@pytest.fixture(scope="module")
def judged(once_per_run) -> Mapping[tuple[str, bool], list[Names]]:
    """Both ways to name layers, on the same random grids, by estimator and kind of truth."""
    return once_per_run("names", lambda folder: names_on_random_grids())


def names_on_random_grids() -> Mapping[tuple[str, bool], list[Names]]:
    scores: dict[tuple[str, bool], list[Names]] = {}
    for independent in (False, True):
        for seed in range(6):
            rng = np.random.default_rng([7, int(independent), seed])
            truth, grid = random_texture(rng), axes(4 + seed % 4, 4 + seed // 2 % 4)
            measured = recording_spectra(
                RecordingSet(
                    Recording(draw(truth(*c), rng, independent=independent), RATE_HZ, *c, "planted")
                    for c in grid
                )
            )
            true = [truth(*c) for c in grid]
            true_hz, width_hz = (
                np.array([getattr(peq, name) for peq in true])
                for name in ("frequencies_hz", "bandwidths_hz")
            )
            for estimator in ("joint", "paper-consistent"):
                model = fit_spectra(measured, estimator=estimator)
                # Of layers that only fill another's shape nobody claims that they are there.
                found = np.flatnonzero(own_peaks(model).is_peak)
                found_hz = model.frequencies_hz.reshape(len(grid), -1)[:, found]
                score = names_kept(true_hz, width_hz, found_hz=found_hz)
                scores.setdefault((estimator, independent), []).append(score)
    return scores


def share(scores: list[Names], part: str, whole: str) -> float:
    return sum(getattr(s, part) for s in scores) / max(1, sum(getattr(s, whole) for s in scores))


@pytest.mark.long("a sweep of random grids")
def test_names_are_kept(judged: Mapping[tuple[str, bool], list[Names]]) -> None:
    joint = judged["joint", False] + judged["joint", True]
    assert share(joint, "kept", "found") >= 0.98
    assert share(joint, "false_layers", "layers") <= 0.1
    assert share(joint, "planted_found", "planted") >= 0.8


@pytest.mark.long("a sweep of random grids")
@pytest.mark.parametrize("independent", [False, True])
def test_naming_the_grid_as_a_whole_beats_tracking_step_by_step(
    judged: Mapping[tuple[str, bool], list[Names]], independent: bool
) -> None:
    """`joint` names layers at least as well as tracking (docs/method/fitting.md#identities)."""
    joint, tracked = (judged[e, independent] for e in ("joint", "paper-consistent"))
    # Of what was planted: a recipe that names only the clearest layers names these well.
    for part in ("kept", "planted_found"):
        assert share(joint, part, "planted") >= share(tracked, part, "planted")
    assert share(joint, "false_layers", "layers") <= share(tracked, "false_layers", "layers")


@pytest.mark.parametrize("by_speed", [0.0, 0.3, 1.0])
def test_smooth_laws_come_back_smooth(by_speed: float) -> None:
    grid = axes(5, 4)

    def truth(v: float, f: float) -> PEQ:
        return planted((120 * (v / 200) ** by_speed, 20, 0.3), (800.0, 60, 0.3))

    found = fit_grid_jointly(spectra(truth, grid))
    frequency = table(found, "frequencies_hz", grid)
    expected = np.array([truth(*c).frequencies_hz for c in grid])  # type: ignore[union-attr]
    assert frequency.shape == expected.shape
    # One record fixes a centre to about √(B/πT); no condition is off by four of these.
    assert (np.abs(frequency - expected) < 4 * np.sqrt(np.array([20, 60]) / np.pi)).all()
    assert not np.array(list(found.inherited.values())).any()


def test_crossing_layers_keep_their_names() -> None:
    grid = axes(7, 4)
    found = fit_grid_jointly(
        spectra(lambda v, f: planted((400.0, 40, 0.3), (2 * v, 30, 0.3)), grid)
    )
    frequency = table(found, "frequencies_hz", grid)
    speed = np.array(grid)[:, 0]
    assert frequency.shape[1] == 2
    assert np.mean(np.abs(frequency[:, 0] - 400) < 25) > 0.9
    assert np.mean(np.abs(frequency[:, 1] - 2 * speed) < 25) > 0.9


@pytest.mark.parametrize("signs", [(1, 1, 1), (1, -1, 1), (-1, 1, -1), (1, 1, -1)])
def test_one_sign_per_layer_over_the_whole_texture(signs: tuple[int, int, int]) -> None:
    grid = axes(4, 4)

    def truth(v: float, f: float) -> PEQ:
        places, gains = np.array([150.0, 300.0, 480.0]), 0.5 * np.array(signs) * (v / 350) ** 0.3
        return planted(*zip(places, (30.0, 40.0, 50.0), gains, strict=True))

    found = fit_grid_jointly(spectra(truth, grid))
    gains = np.sign(table(found, "gains", grid))
    assert (gains == gains[0]).all()
    # What the noise floor has to do with a loud layer's sign a few records may not tell.
    relative = (gains[0][1:] * gains[0][:-1]).tolist()
    assert relative == [a * b for a, b in pairwise(signs)]


# --- what is missing


def test_layers_that_vanish_inherit_their_law_and_stay_faint() -> None:
    grid = axes(5, 4)

    def truth(v: float, f: float) -> PEQ:
        upper = [(500 * (v / 200) ** 0.2, 50.0, 0.3)] if f > 1.0 else []
        return planted((120.0, 20.0, 0.3), *upper)

    found = fit_grid_jointly(spectra(truth, grid))
    frequency, gains = table(found, "frequencies_hz", grid), table(found, "gains", grid)
    speed, force = np.array(grid).T
    gone = force < 1.0
    inherited = np.array([found.inherited[c] for c in grid])
    assert inherited.tolist() == np.stack((np.zeros(20, bool), gone), axis=1).tolist()
    assert frequency[:, 1] == pytest.approx(500 * (speed / 200) ** 0.2, rel=0.06)
    assert np.abs(gains[gone, 1]).max() <= 0.02  # the noise gain at most
    assert np.abs(gains[~gone, 1]).min() > 0.15


@pytest.mark.parametrize("steep", [5.0, 8.0, 20.0])
def test_a_layer_that_leaves_the_band_above(steep: float) -> None:
    """At v/λ beyond the Nyquist frequency; what is predicted there stays legal."""
    grid = axes(7, 4)

    def truth(v: float, f: float) -> PEQ:
        upper = [(steep * v, 60.0, 0.3)] if steep * v < 2300 else []
        return planted((200.0, 40.0, 0.3), *upper)

    found = fit_grid_jointly(spectra(truth, grid))
    frequency = table(found, "frequencies_hz", grid)
    seen = np.array([len(truth(*c).gains) == 2 for c in grid])  # type: ignore[union-attr]
    speed = np.array(grid)[:, 0]
    if frequency.shape[1] == 2:
        assert frequency[seen, 1] == pytest.approx(steep * speed[seen], abs=30)
    assert frequency[:, 0] == pytest.approx(200.0, abs=20)
    assert frequency.shape[1] == 2 or seen.mean() < 0.4


def test_a_layer_that_leaves_the_band_below() -> None:
    """A grating's line at v/5 mm is at 10 Hz at the lowest speed, where the high-pass takes it."""
    grid = axes(7, 4)
    found = fit_grid_jointly(
        spectra(lambda v, f: planted((v / 5, 8.0, 0.5), (700.0, 60.0, 0.3)), grid)
    )
    frequency = table(found, "frequencies_hz", grid)
    speed = np.array(grid)[:, 0]
    assert frequency.shape[1] == 2
    assert frequency[speed > 90, 0] == pytest.approx(speed[speed > 90] / 5, abs=6)


def test_silent_conditions_are_told_by_the_others() -> None:
    grid = axes(5, 4)
    found = fit_grid_jointly(
        spectra(lambda v, f: planted((200.0, 40, 0.3), (700.0, 60, 0.3)) if v > 100 else None, grid)
    )
    silent = np.array(grid)[:, 0] < 100
    assert [found.recorded[c] for c in grid] == (~silent).tolist()
    assert table(found, "frequencies_hz", grid) == pytest.approx(
        np.broadcast_to([200.0, 700.0], (20, 2)), abs=25
    )
    level_sd = table(found, "level_sd_db", grid)
    assert level_sd[silent].min() > level_sd[~silent].max()
    assert table(found, "noise_gain", grid) == pytest.approx(0.02, rel=0.2)


def test_silence_and_white_noise_have_no_layers() -> None:
    grid = axes(4, 4)
    silent = fit_grid_jointly(spectra(lambda v, f: None, grid))
    assert table(silent, "gains", grid).shape == (16, 0)
    assert (table(silent, "noise_gain", grid) == 0).all()
    white = fit_grid_jointly(spectra(lambda v, f: planted(), grid))
    assert table(white, "gains", grid).shape == (16, 0)
    # 2450 lines fix an amplitude to 1/(2√2450).
    assert table(white, "noise_gain", grid) == pytest.approx(0.02, rel=4 / (2 * np.sqrt(2450)))


@pytest.mark.parametrize(("speeds", "forces"), [(1, 1), (2, 2), (2, 3)])
def test_small_grids(speeds: int, forces: int) -> None:
    grid = axes(speeds, forces)
    found = fit_grid_jointly(
        spectra(lambda v, f: planted((200.0, 40, 0.3), (700.0, 60, 0.3)), grid)
    )
    assert table(found, "frequencies_hz", grid) == pytest.approx(
        np.broadcast_to([200.0, 700.0], (len(grid), 2)), abs=25
    )


def test_the_order_in_which_conditions_come_does_not_matter() -> None:
    grid = axes(5, 4)
    texture = random_texture(np.random.default_rng(5))
    measured = spectra(texture, grid)
    found = fit_grid_jointly(measured)
    shuffled = [grid[i] for i in np.random.default_rng(0).permutation(len(grid))]
    again = fit_grid_jointly({c: measured[c] for c in shuffled})
    for name in ("frequencies_hz", "bandwidths_hz", "gains", "noise_gain", "level_sd_db"):
        assert (table(again, name, grid) == table(found, name, grid)).all()
    assert all((again.inherited[c] == found.inherited[c]).all() for c in grid)
