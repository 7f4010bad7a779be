"""One small chart for all tests of its rows, pictures and page."""

from __future__ import annotations

import pytest

from tactileq.benches.chart.chart import Chart, chart_of
from tactileq.benches.chart.judging import Judged, judge
from tactileq.benches.chart.surfaces import Simulated, simulated_sources

FEW_METHODS = (
    "joint, 1 layer",
    "joint, 2 layers",
    "paper-consistent",
    "AR(6)",
    "IIR, 2 sections",
    "joint, direct form",
    "loops of joint",
    "loops of field",
    "loops of spectra",
    "grains, 1/16 s",
    "FFT, 1/16 s",
    "white noise",
    "truth",
)


@pytest.fixture(scope="session")
def judged() -> list[Judged]:
    """A drawn surface, judged by a few methods."""
    [source] = simulated_sources(Simulated(1, ()))
    return [judge(source, methods=FEW_METHODS)]


@pytest.fixture(scope="session")
def chart(judged: list[Judged]) -> Chart:
    return chart_of(judged, turns=2)
