"""Files of the accelerometer's evaluation tool: what is read, and what is refused."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray

from tactileq.modeling import InputError
from tactileq.rig.machines.recorder.evaluation import HEADER, read_evaluation
from tests.refusals import refused


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


def test_line_ends_of_windows_are_read(tmp_path: Path) -> None:
    path = written(tmp_path / "a.csv", noise(100))
    whole = read_evaluation(path, rate_hz=22704.0)
    path.write_bytes(path.read_bytes().replace(b"\n", b"\r\n"))
    assert np.array_equal(read_evaluation(path, rate_hz=22704.0), whole)


@pytest.mark.parametrize(("said", "real"), [(22704.0, 220704.0), (220704.0, 22704.0)])
def test_another_rate_is_refused_with_the_one_that_it_is(
    tmp_path: Path, said: float, real: float
) -> None:
    path = written(tmp_path / "a.csv", noise(3000), rate_hz=real)
    with refused(InputError, names=path.name, expected=f"{said:g}", got=f"{real:g}"):
        read_evaluation(path, rate_hz=said)


@pytest.mark.parametrize("semicolons", [True, False])
def test_decimal_commas_are_refused(tmp_path: Path, semicolons: bool) -> None:
    path = written(tmp_path / "a.csv", noise(100), mark=",")
    if not semicolons:
        path.write_text(path.read_text().replace(";", ","))
    with refused(InputError, names=[path.name, "line 2"], got="commas"):
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
    with refused(InputError, names=path.name):
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
