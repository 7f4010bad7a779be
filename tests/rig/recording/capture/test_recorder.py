"""Two streams fill a grid: coverage, what to stroke next, level and floor, what goes wrong."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from tactileq.modeling import InputError, RecordingSet
from tactileq.rig.recording.capture.coverage import Coverage, advice
from tactileq.rig.recording.capture.grid import StrokeGrid
from tactileq.rig.recording.capture.input import InputBlock
from tactileq.rig.recording.capture.pieces import PieceStore, Plan
from tactileq.rig.recording.capture.recorder import StrokeRecorder, mains_in
from tactileq.rig.shared.live.memory import CONTACT, FORCE_ASSUMED, SIMULATED
from tests.refusals import refused

RATE_HZ = 2000.0
GRID = StrokeGrid([80.0, 160.0], [0.6, 1.2])


class Script:
    """A source and a hand that play what was written, 50 ms at a time."""

    def __init__(self, samples, rows, *, lost_at=()) -> None:
        self._samples, self._rows = samples, rows
        self._lost_at = set(lost_at)
        self.position = self._told = 0
        self.running = True

    def read(self) -> list[InputBlock]:
        blocks = []
        for _ in range(2):
            samples = self._samples[self.position : self.position + 50]
            if samples.size == 0:
                self.running = False
                return blocks
            lost = self.position in self._lost_at
            blocks.append(InputBlock(self.position, samples, self.position / RATE_HZ, lost))
            self.position += samples.size
        return blocks

    def readings(self):
        until = np.searchsorted(self._rows["time_s"], self.position / RATE_HZ)
        new, self._told = self._rows[self._told : until], int(until)
        return new


def recorder_of(script: Script, folder: Path, **changes) -> StrokeRecorder:
    plan = Plan(**{"texture": "oak", "grid": GRID, "rate_hz": RATE_HZ, "wanted_s": 0.5} | changes)
    store = PieceStore(folder, plan)
    return StrokeRecorder(script, script.readings, store=store, g_per_fullscale=10.0)


def play(recorder: StrokeRecorder, steps: int = 0) -> None:
    """So many steps, or all that there is."""
    for _ in range(steps):
        recorder.step()
    if steps == 0:
        with refused(InputError, expected="sound card", got="stream"):
            play(recorder, 1_000_000)


def noise(seconds: float, *, scale: float = 0.01, seed: int = 0) -> np.ndarray:
    return np.random.default_rng(seed).normal(scale=scale, size=round(seconds * RATE_HZ))


def test_strokes_fill_the_grid_whatever_run_they_belong_to(
    tmp_path: Path, readings_of, stroking
) -> None:
    hand = stroking(40.0, GRID.speeds_mm_s, GRID.forces_n, seed=3)
    rows = readings_of(*hand)
    samples = noise(40.0)
    one = recorder_of(Script(samples, rows), tmp_path / "one")
    play(one)
    assert one.coverage.complete
    assert one.coverage.missing == {}
    assert one.target(one.coverage) == (None, [])
    assert one.lost == 0
    assert one.store.counts["clipped"] == 0
    records = RecordingSet.load(tmp_path / "one")
    assert {r.condition for r in records} == set(GRID.conditions)
    assert all(r.simulated and r.duration_s == 0.5 for r in records)
    assert all(r.samples.std() == pytest.approx(0.1, rel=0.15) for r in records)


def test_a_run_that_ends_early_is_gone_on_with(tmp_path: Path, readings_of, stroking) -> None:
    rows = readings_of(*stroking(40.0, GRID.speeds_mm_s, GRID.forces_n, seed=3))
    samples = noise(40.0)
    first = recorder_of(Script(samples, rows), tmp_path / "oak")
    play(first, 60)  # 3 s, and then it is killed
    seconds = first.coverage.seconds
    assert 0 < seconds.sum() < 2.0
    second = recorder_of(Script(samples, rows), tmp_path / "oak")
    assert np.array_equal(second.coverage.seconds, seconds)
    play(second)
    assert second.coverage.complete


def test_lost_samples_are_counted_and_no_piece_spans_them(tmp_path: Path, readings_of) -> None:
    rows = readings_of(np.full(500, 80.0), np.full(500, 0.6))
    script = Script(noise(0.9), rows, lost_at=(50 * 20,))
    recorder = recorder_of(script, tmp_path / "oak", wanted_s=2.0)
    play(recorder)
    assert recorder.lost == 1
    assert "samples of the input were lost at 1 places" in recorder.warnings()[0]
    table = (tmp_path / "oak/pieces/pieces.tsv").read_text().splitlines()
    sizes = [int(line.split("\t")[6]) for line in table[1:]]
    # Of the first, what came after its last reading is missing.
    assert len(sizes) == 2
    assert sizes[0] == pytest.approx(1000, abs=110)
    assert sizes[1] == pytest.approx(800, abs=110)


def test_clipped_pieces_are_counted_and_not_used(tmp_path: Path, readings_of) -> None:
    rows = readings_of(np.full(1000, 80.0), np.full(1000, 0.6))
    samples = noise(2.0)
    samples[1500] = 1.0
    recorder = recorder_of(Script(samples, rows), tmp_path / "oak", wanted_s=0.5)
    play(recorder, 19)
    assert recorder.level.clipping
    assert recorder.level.peak_g == 10.0
    play(recorder)
    assert recorder.store.counts["clipped"] == 1
    assert recorder.coverage.seconds[0, 0] == 0.5
    assert "1 pieces were clipped and are not used; turn the gain" in recorder.warnings()[0]


def test_level_and_floor(tmp_path: Path, readings_of) -> None:
    speed = np.zeros(2000)
    speed[1000:] = 120.0
    samples = np.concatenate((noise(2.0, scale=0.001), noise(2.0, scale=0.02))) + 0.1
    recorder = recorder_of(Script(samples, readings_of(speed, np.full(2000, 0.6))), tmp_path / "o")
    assert np.isnan(recorder.level.floor_g)
    play(recorder)
    assert recorder.level.floor_g == pytest.approx(0.01, rel=0.1)
    assert recorder.level.rms_g == pytest.approx(0.2, rel=0.1)
    assert not recorder.level.clipping
    assert recorder.hand.speed_mm_s == 120
    assert recorder.hand.force_n == 0.6


def test_hum_at_rest_is_told_and_other_noise_is_not(tmp_path: Path, readings_of) -> None:
    time_s = np.arange(6000) / RATE_HZ
    hum = 0.004 * np.sin(2 * np.pi * 50 * time_s) + 0.002 * np.sin(2 * np.pi * 150 * time_s)
    rows = readings_of(np.zeros(1600), np.zeros(1600))
    for name, samples, told in (("hum", hum, 1), ("noise", noise(3.0), 0)):
        recorder = recorder_of(Script(samples + noise(3.0, scale=0.001), rows), tmp_path / name)
        play(recorder)
        assert len(recorder.warnings()) == told
    low = noise(3.0).cumsum() / 100
    assert mains_in(low, RATE_HZ) == 0
    assert mains_in(np.sin(2 * np.pi * 60 * time_s), RATE_HZ) == 60
    assert mains_in(np.sin(2 * np.pi * 80 * time_s), RATE_HZ) == 0


def test_a_hand_outside_of_the_grid_is_told(tmp_path: Path, readings_of) -> None:
    for speed, share in ((300.0, 1), (120.0, 0)):  # beyond the cells, and between them
        rows = readings_of(np.full(6000, speed), np.full(6000, 0.6))
        recorder = recorder_of(Script(noise(11.9), rows), tmp_path / f"{speed:g}")
        play(recorder)
        assert recorder.outside_share == share
        told = (
            "the hand was outside of the grid (72 to 176 mm/s, 0.48 to 1.4 N) for 100% of the time "
            "that it moved; stroke within it, or find your own range with tactileq rig range."
        )
        assert recorder.warnings() == [told] * share


def test_an_input_that_says_nothing_is_told(tmp_path: Path, readings_of) -> None:
    rows = readings_of(np.full(1000, 80.0), np.full(1000, 0.6))
    recorder = recorder_of(Script(np.full(4000, 0.1), rows), tmp_path / "oak")
    play(recorder)
    assert recorder.coverage.seconds.sum() == 0
    assert "the input was entirely silent in 4 pieces, which are not used" in recorder.warnings()[0]


def test_an_assumed_force_fits_a_grid_of_one_force_only(tmp_path: Path, readings_of) -> None:
    rows = readings_of(np.full(600, 80.0), np.full(600, 0.6), flags=CONTACT | FORCE_ASSUMED)
    recorder = recorder_of(Script(noise(1.0), rows), tmp_path / "oak")
    with refused(InputError, expected=["measured", "2 forces"], got="assumed"):
        recorder.step()
    one_force = StrokeGrid([80.0, 160.0], [0.6])
    other = StrokeGrid([80.0, 160.0], [1.2])
    recorder = recorder_of(Script(noise(1.0), rows), tmp_path / "ash", grid=other)
    with refused(InputError, expected="1.2 N", got="0.6 N"):
        recorder.step()
    recorder = recorder_of(Script(noise(1.0), rows), tmp_path / "elm", grid=one_force)
    play(recorder)
    assert recorder.coverage.seconds.ravel().tolist() == [0.5, 0.0]
    assert (tmp_path / "elm/pieces/pieces.tsv").read_text().split("\t")[-1].strip() == "true"
    assert not rows["flags"][0] & SIMULATED


def test_what_to_stroke_next_stays_until_it_is_full() -> None:
    coverage = Coverage(GRID, 1.0, seconds={(80.0, 0.6): 1.0, (160.0, 1.2): 0.5})
    assert coverage.missing == {(80.0, 1.2): 1.0, (160.0, 0.6): 1.0, (160.0, 1.2): 0.5}
    assert coverage.next_condition(150, 1.1) == (160.0, 1.2)
    assert coverage.next_condition(150, 1.1, current=(160.0, 0.6)) == (160.0, 0.6)
    assert coverage.next_condition(150, 1.1, current=(80.0, 0.6)) == (160.0, 1.2)
    assert Coverage(GRID, 1.0, seconds=dict.fromkeys(GRID.conditions, 1.0)).next_condition(
        1, 1
    ) is (None)


@pytest.mark.parametrize(
    ("hand", "words"),
    [
        ((160, 1.2), []),
        ((-160, 1.2), []),
        ((100, 1.2), ["faster"]),
        ((200, 1.6), ["slower", "lighter"]),
        ((160, 0.5), ["harder"]),
    ],
)
def test_advice(hand, words) -> None:
    assert advice(GRID, (160.0, 1.2), speed_mm_s=hand[0], force_n=hand[1]) == words


def test_only_wanted_conditions_are_asked_for_and_kept(
    tmp_path: Path, readings_of, stroking
) -> None:
    wanted = [(80.0, 1.2), (160.0, 0.6)]
    grid = StrokeGrid([80.0, 160.0], [0.6, 1.2], conditions=wanted)
    rows = readings_of(*stroking(30.0, grid.speeds_mm_s, grid.forces_n, seed=3))
    recorder = recorder_of(Script(noise(30.0), rows), tmp_path / "oak", grid=grid)
    asked = set()
    for _ in range(600):
        recorder.step()
        asked.add(recorder.target(recorder.coverage)[0])
        if recorder.coverage.complete:
            break
    assert None in asked
    assert asked <= {*wanted, None}
    assert recorder.coverage.full.tolist() == [[False, True], [True, False]]
    assert recorder.coverage.seconds.tolist() == [[0.0, 0.5], [0.5, 0.0]]
    assert recorder.store.conditions_recorded == 2
    assert {r.condition for r in RecordingSet.load(tmp_path / "oak")} == set(wanted)
    kept = (tmp_path / "oak/pieces/pieces.tsv").read_text().splitlines()[1:]
    assert {tuple(map(float, line.split("\t")[2:4])) for line in kept} == set(wanted)


def test_pieces_of_a_condition_that_is_not_wanted_any_more_stay(
    tmp_path: Path, readings_of
) -> None:
    rows = readings_of(np.full(150, 80.0), np.full(150, 0.6))
    first = recorder_of(Script(noise(0.3), rows), tmp_path / "oak")
    play(first)
    assert first.coverage.missing[80.0, 0.6] < 0.3
    other = StrokeGrid([80.0, 160.0], [0.6, 1.2], conditions=[(160.0, 1.2)])
    second = recorder_of(Script(noise(0.3), rows), tmp_path / "oak", grid=other)
    play(second)
    assert second.coverage.seconds.sum() == 0
    third = recorder_of(Script(noise(0), rows), tmp_path / "oak")
    assert np.array_equal(third.coverage.seconds, first.coverage.seconds)


def test_the_next_condition_is_a_wanted_one_wherever_the_hand_is() -> None:
    wanted = [(80.0, 1.2), (160.0, 0.6)]
    grid = StrokeGrid([80.0, 160.0], [0.6, 1.2], conditions=wanted)
    # What is not wanted does not count, recorded or not.
    empty = Coverage(grid, 1.0, seconds={(80.0, 0.6): 0.5, (160.0, 1.2): 1.0})
    assert empty.missing == dict.fromkeys(wanted, 1.0)
    assert empty.next_condition(80, 0.7) == (80.0, 1.2)
    assert empty.next_condition(160, 1.1) == (160.0, 0.6)
    assert not empty.complete
    full = Coverage(grid, 1.0, seconds=dict.fromkeys(wanted, 1.0))
    assert full.complete
    assert full.next_condition(80, 0.6) is None
