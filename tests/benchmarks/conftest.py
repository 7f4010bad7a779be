"""Benchmarks: each group holds one rival, and the run ends with the ratios to it.

`make test` runs each once, on less, for what it asserts; `make bench` times them.
"""

from __future__ import annotations

from collections.abc import Iterator

import pytest

from tactileq.modeling import Recording, RecordingSet
from tactileq.modeling.threads import one_linear_algebra_thread
from tactileq.stimuli.planted.textures import (
    FORCES_N,
    RECORDER_RATE_HZ,
    SPEEDS_MM_S,
    TEXTURES,
    planted_texture,
    record_texture,
)

RIVAL = "rival"


@pytest.fixture(autouse=True)
def one_thread() -> Iterator[None]:
    """BLAS and OpenMP on one thread, so that ratios compare algorithms."""
    with one_linear_algebra_thread():
        yield


@pytest.fixture(scope="session")
def timed(request: pytest.FixtureRequest) -> bool:
    """Whether times are taken."""
    return bool(request.config.getoption("benchmark_enable"))


@pytest.fixture(scope="session")
def study(timed: bool) -> tuple[RecordingSet, ...]:
    """A whole study, simulated: 7 textures × 49 conditions, 1 s at 22 704 Hz (untimed: 1 × 9)."""
    names = list(TEXTURES) if timed else list(TEXTURES)[:1]
    some = slice(None, None, 1 if timed else 3)
    axes = {"speeds_mm_s": SPEEDS_MM_S[some], "forces_n": FORCES_N[some]}
    truths = [planted_texture(name, **axes, rate_hz=RECORDER_RATE_HZ) for name in names]
    return tuple(record_texture(truth, seed=1) for truth in truths)


@pytest.fixture(scope="session")
def records(study: tuple[RecordingSet, ...]) -> list[Recording]:
    """Of each texture the record in the middle of the grid."""
    return [recordings.recordings[len(recordings) // 2] for recordings in study]


def pytest_terminal_summary(
    terminalreporter: pytest.TerminalReporter, config: pytest.Config
) -> None:
    """Shortest times as multiples of the rival's in the same group and run."""
    session = getattr(config, "_benchmarksession", None)
    timed = [bench for bench in getattr(session, "benchmarks", []) if bench.stats.data]
    rivals = {bench.group: bench for bench in timed if RIVAL in bench.extra_info}
    if not rivals:
        return
    terminalreporter.section("shortest times as multiples of the rival's")
    for bench in timed:
        if (rival := rivals.get(bench.group)) not in (None, bench):
            ratio = bench.stats.min / rival.stats.min
            what = f"{bench.extra_info['what']} / {rival.extra_info['what']}"
            terminalreporter.write_line(f"{bench.group}: {what}: {ratio:.3g}")
