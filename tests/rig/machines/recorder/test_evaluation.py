"""Files of the accelerometer's evaluation tool: what is read, and what is refused."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray

from tactileq.modeling import InputError
from tactileq.rig.machines.recorder.evaluation import HEADER, read_evaluation
from tests.refusals import check_refusal, refused


def written(
    path: Path, samples_g: NDArray[np.float64], *, rate_hz: float = 22704.0, mark: str = "."
) -> Path:
    """As the tool writes it: six decimals of the time, four of g."""
    times = np.arange(samples_g.shape[1]) / rate_hz
    rows = [
        f"{time_s:.6f},{x:.4f},{y:.4f},{z:.4f}"
        for time_s, x, y, z in zip(times.tolist(), *samples_g.tolist(), strict=True)
    ]
    if mark == ",":
        rows = [row.replace(",", ";").replace(".", ",") for row in rows]
    path.write_text("\n".join([HEADER, *rows]) + "\n", encoding="utf-8", newline="")
    return path


def noise(count: int, seed: int = 0) -> NDArray[np.float64]:
    return np.random.default_rng(seed).normal(0, 0.2, (3, count))


@pytest.mark.parametrize(("rate_hz", "count"), [(22704.0, 22704), (220704.0, 6897 * 32)])
def test_both_rates_are_read(tmp_path: Path, rate_hz: float, count: int) -> None:
    samples = noise(count)
    path = written(tmp_path / "a.csv", samples, rate_hz=rate_hz)
    for axis, expected in zip("xyz", samples, strict=True):
        found = read_evaluation(path, rate_hz=rate_hz, axis=axis)  # type: ignore[arg-type]
        assert found.size == count
        assert np.abs(found - expected).max() <= 0.5001e-4


def published(path: Path, count: int) -> NDArray[np.float64]:
    """As the only published file is: ms at 220 kSPS under Time(s), counted, the first one odd."""
    samples = noise(count)
    samples[2] += 1
    times = np.arange(count) / 220
    times[0] = 0.000011
    rows = zip(times.tolist(), *samples.tolist(), strict=True)
    lines = [f"{time:.6f},{x:.4f},{y:.4f},{z:.4f}" for time, x, y, z in rows]
    path.write_text("\n".join([HEADER, *lines]) + "\n")
    return samples


def test_times_in_ms_are_taken_where_they_have_the_rate_that_is_stated(tmp_path: Path) -> None:
    path = tmp_path / "a.csv"
    samples = published(path, 22_000)
    told: list[str] = []
    found = read_evaluation(path, rate_hz=220e3, tell=told.append)
    assert np.abs(found - samples[2]).max() <= 0.5001e-4
    check_refusal(told[0], names=["in ms", "sensor.rate_hz"])
    for other in (22704.0, 220704.0):
        with refused(
            InputError, names=path.name, expected=f"{other:g} Hz", got=["220 Hz (in s)", "220000"]
        ) as error:
            read_evaluation(path, rate_hz=other)
        assert accepted(path, error) == [220, 220_000]


def test_counted_times_are_said_since_they_hide_lost_samples(tmp_path: Path) -> None:
    path = tmp_path / "a.csv"
    rng = np.random.default_rng(0)
    for shift_s, said in ((0.0, True), (8e-6, False)):
        written(path, noise(2000))
        lines = path.read_text().splitlines()
        moved = [float(line[:8]) + shift_s * rng.uniform() for line in lines[1:]]
        rows = [f"{at:.6f}{line[8:]}" for at, line in zip(moved, lines[1:], strict=True)]
        path.write_text("\n".join([HEADER, *rows]) + "\n")
        told: list[str] = []
        read_evaluation(path, rate_hz=22704.0, tell=told.append)
        assert ["lost" in sentence for sentence in told] == [True] * said


@pytest.mark.parametrize("part", [slice(None), slice(500, 3000)])
def test_a_sensor_that_stands_still_is_refused(tmp_path: Path, part: slice) -> None:
    samples = noise(4000)
    samples[2, part] = 0.9998
    path = written(tmp_path / "a.csv", samples)
    with refused(InputError, names=path.name, expected="change", got=["0.9998", "s"]):
        read_evaluation(path, rate_hz=22704.0)
    read_evaluation(path, rate_hz=22704.0, axis="y")


def test_line_ends_of_windows_are_read(tmp_path: Path) -> None:
    path = written(tmp_path / "a.csv", noise(100))
    whole = read_evaluation(path, rate_hz=22704.0)
    path.write_bytes(path.read_bytes().replace(b"\n", b"\r\n"))
    assert np.array_equal(read_evaluation(path, rate_hz=22704.0), whole)


def accepted(path: Path, refusal: pytest.ExceptionInfo[InputError]) -> list[float]:
    """The rates that a refusal offers, each of which has to be accepted as it stands there."""
    rates_hz = [float(rate) for rate in re.findall(r"([\d.]+) Hz \(in", str(refusal.value))]
    for rate_hz in rates_hz:
        read_evaluation(path, rate_hz=rate_hz)
    return rates_hz


@pytest.mark.parametrize(("said", "real"), [(22704.0, 220704.0), (220704.0, 22704.0)])
def test_another_rate_is_refused_with_the_one_that_it_is(
    tmp_path: Path, said: float, real: float
) -> None:
    path = written(tmp_path / "a.csv", noise(3000), rate_hz=real)
    with refused(InputError, names=path.name, expected=f"{said:g}") as error:
        read_evaluation(path, rate_hz=said)
    assert real in [pytest.approx(rate_hz, rel=1e-4) for rate_hz in accepted(path, error)]


@pytest.mark.parametrize("semicolons", [True, False])
def test_decimal_commas_are_refused(tmp_path: Path, semicolons: bool) -> None:
    path = written(tmp_path / "a.csv", noise(100), mark=",")
    text = path.read_text()
    others = [text, text.replace(HEADER, HEADER.replace(",", ";"))]
    for other in others if semicolons else [text.replace(";", ",")]:
        path.write_text(other)
        with refused(
            InputError, names=[path.name, "line 2"], expected="points", got="number format"
        ):
            read_evaluation(path, rate_hz=22704.0)


@pytest.mark.parametrize(
    ("old", "new", "names"),
    [
        ("0.2", "nan", "line"),
        ("0.2", "", "line"),
        ("ay(g)", "ay(mg)", "header"),
        ("ay(g),", "", "header"),
    ],
)
def test_what_is_no_such_file_is_refused(tmp_path: Path, old: str, new: str, names: str) -> None:
    path = tmp_path / "a.csv"
    rows = "".join(f"{n / 22704:.6f},0.1{n},0.2,0.3\n" for n in range(100))
    path.write_text(f"{HEADER}\n{rows}".replace(old, new, 1))
    with refused(InputError, names=[path.name, names]):
        read_evaluation(path, rate_hz=22704.0)


def test_missing_samples_and_a_truncated_file_are_refused(tmp_path: Path) -> None:
    path = written(tmp_path / "a.csv", noise(2000))
    lines = path.read_text().splitlines()
    path.write_text("\n".join([*lines[:1000], *lines[1040:]]) + "\n")
    with refused(InputError, names=[path.name, "missing"], expected="evenly"):
        read_evaluation(path, rate_hz=22704.0)
    path.write_text("\n".join(lines[:1500]))
    with refused(InputError, names=path.name, expected="whole line"):
        read_evaluation(path, rate_hz=22704.0)


def test_samples_at_the_sensors_limit_are_refused(tmp_path: Path) -> None:
    samples = noise(1000)
    samples[0, 500] = 50.0  # of an axis that is not the one
    path = written(tmp_path / "a.csv", samples)
    with refused(InputError, names=path.name, expected=["50", "g"], got="1"):
        read_evaluation(path, rate_hz=22704.0, axis="z")
