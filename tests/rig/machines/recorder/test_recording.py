"""Plans on a simulated recorder: nothing lost, nothing twice, nothing stored that was refused."""

from __future__ import annotations

import multiprocessing
import os
import re
import shutil
import threading
import time
from collections import Counter
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

from tactileq.modeling import InputError, RecordingSet
from tactileq.modeling.arrays import Floats
from tactileq.modeling.files.tables import read_cells
from tactileq.rig.machines.board.virtual import TICK_HZ
from tactileq.rig.machines.recorder.driver import Recorder, RecordRefused, VirtualWire
from tactileq.rig.machines.recorder.law import RecorderLaw
from tactileq.rig.machines.recorder.recording import SETTLES_S, PlanRun
from tactileq.rig.machines.recorder.registers import (
    RecorderCause,
    RecorderSimulation,
    RecorderState,
)
from tactileq.rig.machines.recorder.sensors import (
    SETTLED_S,
    DrawnVibration,
    EvaluationFiles,
    SensorRefused,
    SoundCardSensor,
)
from tactileq.rig.machines.recorder.store import (
    PLAN_NAME,
    RECORDER_COLUMNS,
    TABLE_NAME,
    RecorderStore,
)
from tactileq.rig.recording.capture.grid import StrokeGrid
from tactileq.rig.recording.capture.input import InputBlock
from tactileq.rig.recording.capture.pieces import Plan
from tests.refusals import refused
from tests.rig.machines.recorder.test_evaluation import noise, written

RATE_HZ = 1000.0
FORK = multiprocessing.get_context("fork")
SMALL = StrokeGrid([100.0, 200.0], [1.0, 2.0])


def plan(
    grid: StrokeGrid = SMALL, texture: str = "oak", rate_hz: float = RATE_HZ, wanted_s: float = 0.2
) -> Plan:
    return Plan(texture, grid, rate_hz, wanted_s=wanted_s, simulated=True)


def drawn(
    speed_mm_s: float, force_n: float, duration_s: float, condition: tuple[float, float]
) -> Floats:
    """Noise whose level says what emerged."""
    rng = np.random.default_rng([round(value) for value in condition])
    level: Floats = speed_mm_s * force_n * rng.normal(size=round(duration_s * RATE_HZ))
    return level


def run_of(
    folder: Path,
    of: Plan | None = None,
    *,
    wire: VirtualWire | None = None,
    law: RecorderLaw | None = None,
) -> PlanRun:
    recorder = Recorder(wire or VirtualWire(), law or RecorderLaw())
    sensor = DrawnVibration(RATE_HZ, recorder.emerged, drawn)
    store = RecorderStore(folder, of or plan(), radius_mm=recorder.law.radius_mm)
    return PlanRun(recorder, sensor, store, 0.1)


def rows_of(folder: Path) -> list[dict[str, str]]:
    return [row for _, row in read_cells(folder / TABLE_NAME, RECORDER_COLUMNS)]


def test_a_plan_is_recorded_with_what_was_held(tmp_path: Path) -> None:
    told: list[tuple[float, float]] = []
    run_of(tmp_path / "oak").run(told.append)
    assert told == SMALL.conditions
    records = {r.condition: r for r in RecordingSet.load(tmp_path / "oak")}
    rows = rows_of(tmp_path / "oak")
    assert len(rows) == len(records) == 4
    for row in rows:
        speed, force = float(row["speed_mm_s"]), float(row["force_n"])
        true_speed, true_force = float(row["true_speed_mm_s"]), float(row["true_force_n"])
        assert float(row["mean_speed_mm_s"]) == pytest.approx(true_speed, rel=0.02)
        assert float(row["mean_force_n"]) == pytest.approx(true_force, rel=0.02)
        record = records[speed, force]
        assert record.simulated
        expected = drawn(true_speed, true_force, 0.2, (speed, force))
        assert record.samples == pytest.approx(expected, rel=1e-4)
        turned = (float(row["end_turn"]) - float(row["start_turn"])) % 1
        assert turned == pytest.approx(true_speed * 0.2 / (2 * np.pi * 40.0), abs=5e-3)
    assert run_of(tmp_path / "oak").store.missing == []


def _go_on(folder: str) -> None:
    run_of(Path(folder), plan(StrokeGrid.default())).run()


@pytest.mark.timeout(120)
def test_twenty_kills_at_random_moments_lose_and_double_nothing(tmp_path: Path) -> None:
    """All that was there before a kill is there after it, bit for bit."""
    folder, rng, kills = tmp_path / "oak", np.random.default_rng(1), 0
    before: dict[tuple[float, float], bytes] = {}
    wanted = set(StrokeGrid.default().conditions)
    while kills < 20:
        process = FORK.Process(target=_go_on, args=(str(folder),))
        process.start()
        time.sleep(rng.uniform(0.005, 0.09))
        kills += process.is_alive()
        process.kill()
        process.join()
        if run_of(folder, plan(StrokeGrid.default())).store.missing == sorted(wanted):
            continue
        found = {r.condition: r.samples.tobytes() for r in RecordingSet.load(folder)}
        assert before.items() <= found.items()
        before = found
        assert len(before) < len(wanted), "too quick to be killed twenty times"
    run_of(folder, plan(StrokeGrid.default())).run()
    records = RecordingSet.load(folder)
    assert Counter(r.condition for r in records) == Counter(wanted)
    pairs = [(float(row["speed_mm_s"]), float(row["force_n"])) for row in rows_of(folder)]
    assert Counter(pairs) == Counter(wanted)
    listed = {f"{number:04d}.csv" for number in range(1, 200)} & set(os.listdir(folder))
    assert len(listed) == len(wanted)


@pytest.mark.parametrize(
    ("what", "cause"),
    [
        (RecorderSimulation.TABLE_STUCK, RecorderCause.STUCK),
        (RecorderSimulation.ARM_STUCK, RecorderCause.STUCK),
        (RecorderSimulation.SLIPPING, RecorderCause.SLIPS),
        (RecorderSimulation.NO_SAMPLE, RecorderCause.NO_TOUCH),
        (RecorderSimulation.MOTOR, RecorderCause.NOT_WRITTEN),
    ],
)
def test_what_somebody_has_to_mend_ends_the_run_and_stores_nothing(
    tmp_path: Path, what: RecorderSimulation, cause: RecorderCause
) -> None:
    wire = VirtualWire()
    hasty = RecorderLaw(patience_s=1.5)
    run = run_of(tmp_path / "oak", wire=wire, law=hasty)
    with pytest.raises(RecordRefused) as told:
        run.run(lambda _: run.recorder.spoil(what))
    assert told.value.cause == cause
    assert len(RecordingSet.load(tmp_path / "oak")) == len(rows_of(tmp_path / "oak")) == 1
    run.recorder.spoil(RecorderSimulation.NONE)
    for _ in range(100):  # it runs down
        wire.pause(0.09)
    run.run()
    assert len(RecordingSet.load(tmp_path / "oak")) == 4


def test_a_computer_that_paused_costs_an_attempt(tmp_path: Path) -> None:
    wire = VirtualWire()
    run = run_of(tmp_path / "oak", wire=wire)
    pauses = iter([True, False, True, True, True])

    def begin(duration_s: float) -> None:
        start(duration_s)
        if next(pauses, False):
            wire.transport.step(TICK_HZ // 5)  # twice as long as the recorder waits

    start = run.sensor.begin
    run.sensor.begin = begin  # type: ignore[method-assign]
    run.run()
    assert [row["attempts"] for row in rows_of(tmp_path / "oak")] == ["2", "1", "1"]
    assert len(run.refused) == 1
    assert run.store.missing == [SMALL.conditions[1]]


@pytest.mark.parametrize(
    ("other", "names"),
    [
        ({"texture": "ash"}, ["oak", "ash"]),
        ({"rate_hz": 2000.0}, ["1000", "2000"]),
        ({"wanted_s": 0.5}, ["0.2", "0.5"]),
    ],
)
def test_an_interrupted_plan_is_not_left_for_another(
    tmp_path: Path, other: dict[str, object], names: list[str]
) -> None:
    folder = tmp_path / "oak"
    with pytest.raises(KeyboardInterrupt):
        run_of(folder).run(_interrupt)
    files = {path.name: path.read_bytes() for path in folder.iterdir()}
    with refused(InputError, names=[folder, "1 of 4"], expected=names[0], got=names[1]):
        run_of(folder, plan(**other))  # type: ignore[arg-type]
    assert {path.name: path.read_bytes() for path in folder.iterdir()} == files
    run_of(folder).run()
    run_of(folder, plan(texture="ash")).run()  # the one before is finished
    records = RecordingSet.load(folder)
    assert Counter(r.texture for r in records) == {"oak": 4, "ash": 4}
    assert Counter(row["texture"] for row in rows_of(folder)) == {"oak": 4, "ash": 4}


@pytest.mark.parametrize("finished", [False, True])
def test_a_plan_goes_on_under_its_own_seed_only(tmp_path: Path, finished: bool) -> None:
    def begin(seed: int | None, of: Plan | None = None) -> RecorderStore:
        return RecorderStore(tmp_path / "oak", of or plan(), radius_mm=40.0, seed=seed)

    run = run_of(tmp_path / "oak")
    run.store = begin(3)
    if finished:
        run.run()
    else:
        with pytest.raises(KeyboardInterrupt):
            run.run(_interrupt)
    with refused(
        InputError, names=[tmp_path / "oak", "--repeat"], expected="--seed 3", got=["4", "--seed 3"]
    ):
        begin(4)
    assert len(begin(3).missing) == (0 if finished else 3)
    begin(4, replace(plan(), repeat=2))
    # A plan of an earlier version says of no seed.
    path = tmp_path / "oak" / PLAN_NAME
    path.write_text(path.read_text().replace('"seed": 3', '"seed": null'))
    begin(4)
    path.write_text(re.sub(r',\s*"seed": null', "", path.read_text()))
    assert "seed" not in path.read_text()
    begin(4)


def _interrupt(_: object) -> None:
    raise KeyboardInterrupt


def test_a_folder_or_plan_of_something_else_is_refused(tmp_path: Path) -> None:
    (tmp_path / "notes.txt").write_text("mine")
    with refused(InputError, names=tmp_path):
        run_of(tmp_path)
    run_of(tmp_path / "oak").run()
    (tmp_path / "oak" / PLAN_NAME).write_text('{"texture": "oak"}')
    with refused(InputError, names=PLAN_NAME):
        run_of(tmp_path / "oak")


@pytest.mark.parametrize(
    ("speeds", "forces", "expected", "got"),
    [
        ([100.0], [2.0, 6.0], "N", "6"),
        ([100.0], [0.02, 1.0], "N", "0.02"),
        ([100.0, 900.0], [2.0], "744", "900"),
        ([10.0, 100.0], [2.0], "26", "10"),
    ],
)
def test_a_grid_beyond_the_motors_is_refused_with_the_largest_that_holds(
    tmp_path: Path, speeds: list[float], forces: list[float], expected: str, got: str
) -> None:
    run = run_of(tmp_path / "oak", plan(StrokeGrid(speeds, forces)))
    with refused(InputError, expected=expected, got=got):
        run.run()
    assert not (tmp_path / "oak").exists()
    largest = run.recorder.law.largest_force_n(SETTLES_S + run.run_in_s + 0.2)
    run_of(tmp_path / "ash", plan(StrokeGrid([100.0], [np.floor(100 * largest) / 100]))).run()


def test_the_smallest_speed_that_is_accepted_can_be_recorded(tmp_path: Path) -> None:
    for entropy in range(4):  # whatever the angle at the start
        wire = VirtualWire(entropy=entropy)
        run = run_of(tmp_path / str(entropy), plan(StrokeGrid([26.0, 744.0], [2.0])), wire=wire)
        run.run()
        assert run.store.missing == []


def test_a_recorder_that_has_forgotten_its_law_is_told_anew(tmp_path: Path) -> None:
    wire = VirtualWire()
    run = run_of(tmp_path / "oak", wire=wire)
    run.run(lambda _: wire.write("Contact", (0.02, 5000.0)))  # as after a start of its own
    for row in rows_of(tmp_path / "oak"):
        assert float(row["true_force_n"]) == pytest.approx(float(row["force_n"]), rel=0.03)


@pytest.mark.parametrize("other", [{"rate_hz": 2000.0}, {"wanted_s": 0.5}, {"simulated": False}])
def test_recordings_that_the_plan_would_not_make_do_not_count(
    tmp_path: Path, other: dict[str, object]
) -> None:
    run_of(tmp_path / "oak").run()
    changed = replace(plan(), **other)  # type: ignore[arg-type]
    with refused(InputError, names=[tmp_path / "oak", "--repeat"]):
        run_of(tmp_path / "oak", changed)
    again = run_of(tmp_path / "oak", replace(changed, repeat=2))
    assert again.store.missing == SMALL.conditions


def test_without_index_or_table_the_rest_is_kept_and_said(tmp_path: Path) -> None:
    folder = tmp_path / "oak"
    run_of(folder).run()
    (folder / TABLE_NAME).unlink()
    assert "none for 4" in run_of(folder).store.damaged[0]
    (folder / "recordings.tsv").unlink()
    run = run_of(folder)
    run.run()
    assert "0001.csv" in run.store.damaged[-1]
    assert len(RecordingSet.load(folder)) == 4
    assert (folder / "0001.csv").is_file()


# --- Sensors -------------------------------------------------------------------------------------


def held(sensor: EvaluationFiles) -> None:
    """Wait as the driver does."""
    end_s = time.monotonic() + 500
    while not sensor.enough():
        assert time.monotonic() < end_s
        time.sleep(0.02)


def test_a_file_that_appears_ends_the_record_once_it_is_whole(tmp_path: Path) -> None:
    samples = noise(700)
    written(tmp_path / "before.csv", samples)
    sensor = EvaluationFiles(tmp_path, rate_hz=1000.0, axis="y", wait_s=5.0)
    assert sensor.hold_s(0.5) == 5.0 + SETTLED_S
    sensor.begin(0.5)
    assert not sensor.enough()
    whole = written(tmp_path / "spool", samples, rate_hz=1000.0).read_bytes()
    file = tmp_path / "next.csv"
    time.sleep(0.7)  # as long as it measures
    file.write_bytes(whole[:1000])
    threading.Timer(0.1, file.write_bytes, (whole,)).start()
    held(sensor)
    assert sensor.samples((100.0, 1.0)) == pytest.approx(samples[1, :500], abs=0.5e-4)


@pytest.mark.parametrize(
    ("count", "rate_hz", "names"),
    [(468, 1000.0, ["500", "468", "lost"]), (2000, 1000.0, ["clocks", "2.00"])],
)
def test_files_too_short_or_longer_than_speed_was_held_are_refused(
    tmp_path: Path, count: int, rate_hz: float, names: list[str]
) -> None:
    """The first has lost a frame; the second is of a sensor at another rate than the file says."""
    sensor = EvaluationFiles(tmp_path, rate_hz=rate_hz, axis="z", wait_s=5.0)
    sensor.begin(0.5)
    written(tmp_path / "a.csv", noise(count), rate_hz=rate_hz)
    held(sensor)
    with refused(InputError, names=["a.csv", *names]):
        sensor.samples((100.0, 1.0))


def test_the_researcher_is_told_when_to_save_and_a_bad_file_is_an_attempt(tmp_path: Path) -> None:
    """The first file is clipped, the second one good; both appear while speed is held."""
    told: list[str] = []
    (tmp_path / "adcm").mkdir()
    loud = noise(300)
    loud[2, 7] = 50.0
    files = iter([("a.csv", loud), ("b.csv", noise(300))])

    def tell(sentence: str) -> None:
        if "save" not in sentence:
            return
        told.append(sentence)
        name, samples = next(files)
        threading.Timer(0.35, written, (tmp_path / "adcm" / name, samples), kwargs).start()

    kwargs = {"rate_hz": 1000.0}
    wire = VirtualWire()
    pause = wire.pause

    def real_time(seconds: float) -> None:
        pause(seconds)
        if wire.read("State") == RecorderState.RECORDS:
            time.sleep(seconds)

    wire.pause = real_time  # type: ignore[method-assign]
    recorder = Recorder(wire, RecorderLaw())
    sensor = EvaluationFiles(tmp_path / "adcm", axis="z", wait_s=5.0, tell=tell, **kwargs)
    one = plan(StrokeGrid([200.0], [2.0]))
    said: list[str] = []
    store = RecorderStore(tmp_path / "oak", one, radius_mm=40.0)
    PlanRun(recorder, sensor, store, 0.1, tell=said.append).run()
    assert len(told) == 2
    assert all(str(tmp_path / "adcm") in sentence for sentence in told)
    (sentence,) = said
    assert "a.csv" in sentence
    assert rows_of(tmp_path / "oak")[0]["attempts"] == "2"


def test_a_file_that_is_overwritten_counts_and_two_are_refused(tmp_path: Path) -> None:
    told: list[str] = []
    sensor = EvaluationFiles(tmp_path, rate_hz=1000.0, axis="z", wait_s=5.0, tell=told.append)
    written(tmp_path / "DATA.CSV", noise(300, seed=1), rate_hz=1000.0)
    (tmp_path / "gone.csv").symlink_to(tmp_path / "nowhere")
    sensor.begin(0.2)
    time.sleep(0.4)
    written(tmp_path / "DATA.CSV", noise(300, seed=2), rate_hz=1000.0)
    held(sensor)
    expected = noise(300, seed=2)[2, :200]
    assert sensor.samples((100.0, 1.0)) == pytest.approx(expected, abs=0.5e-4)
    sensor.begin(0.2)
    for name in ("a.csv", "b.csv"):
        written(tmp_path / name, noise(300), rate_hz=1000.0)
    held(sensor)
    with refused(SensorRefused, got=["a.csv", "b.csv"]):
        sensor.samples((100.0, 1.0))
    (noted,) = (sentence for sentence in told if "lost" in sentence)
    assert "DATA.CSV" in noted


def test_no_file_and_no_folder_are_said(tmp_path: Path) -> None:
    sensor = EvaluationFiles(tmp_path, rate_hz=1000.0, axis="z", wait_s=0.1)
    sensor.begin(0.5)
    with refused(InputError, names=tmp_path):
        sensor.samples((100.0, 1.0))
    with refused(InputError, names="none"):
        EvaluationFiles(tmp_path / "none", rate_hz=1000.0, axis="z", wait_s=0.1)


class Card:
    """A sound card whose samples come as the recorder's virtual time goes on."""

    settings = SimpleNamespace(g_per_fullscale=50.0)
    running = True

    def __init__(self, now_s: Callable[[], float], *, rate_hz: float, stated_hz: float) -> None:
        self.rate_hz, self._true_hz, self._now_s = stated_hz, rate_hz, now_s
        self._position = 0
        self.level, self.lost = 0.01, False

    def read(self) -> list[InputBlock]:
        until = int(self._now_s() * self._true_hz)
        blocks = []
        while self._position + 20 <= until:
            samples = self.level * np.ones(20)
            samples[::2] *= -1
            blocks.append(InputBlock(self._position, samples, 0.0, self.lost))
            self._position += 20
        return blocks


def on_card(folder: Path, *, rate_hz: float, stated_hz: float) -> tuple[PlanRun, Card]:
    wire = VirtualWire()
    recorder = Recorder(wire, RecorderLaw())
    card = Card(wire.transport.now_s, rate_hz=rate_hz, stated_hz=stated_hz)
    store = RecorderStore(folder, plan(rate_hz=stated_hz), radius_mm=recorder.law.radius_mm)
    return PlanRun(recorder, SoundCardSensor(card), store, 0.1), card  # type: ignore[arg-type]


def test_a_sound_card_gives_what_it_heard_while_speed_was_held(tmp_path: Path) -> None:
    run, _ = on_card(tmp_path / "oak", rate_hz=1000.0, stated_hz=1000.0)
    run.run()
    records = RecordingSet.load(tmp_path / "oak")
    assert len(records) == 4
    assert all(np.abs(r.samples).max() == 0.5 and r.samples.size == 200 for r in records)


@pytest.mark.parametrize("stated_hz", [1088.0, 919.0, 950.0])
def test_clocks_of_sensor_and_wire_that_disagree_are_refused(
    tmp_path: Path, stated_hz: float
) -> None:
    """44.1 kHz stated as 48 kHz, the reverse, and 5 % off."""
    run, _ = on_card(tmp_path / "oak", rate_hz=1000.0, stated_hz=stated_hz)
    with refused(InputError, names=["clocks", "sensor.rate_hz"]):
        run.run()
    assert run.store.missing == SMALL.conditions


def test_clipping_gaps_and_a_card_that_is_gone_are_refused(tmp_path: Path) -> None:
    for name, value, said in (
        ("level", 1.0, "full scale"),
        ("level", 0.0, "change"),
        ("lost", True, "gap"),
        ("running", False, "sound card"),
    ):
        run, card = on_card(tmp_path / name, rate_hz=1000.0, stated_hz=1000.0)
        setattr(card, name, value)
        with refused(InputError, names=said):
            run.run()
        assert run.store.missing == SMALL.conditions
        shutil.rmtree(tmp_path / name, ignore_errors=True)
