"""What takes minutes at full effort: the demo on devices, the atlas, the chart."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import pytest

pytestmark = [
    pytest.mark.long("whole demos, and atlas and chart at full effort"),
    pytest.mark.timeout(7200),
]


@pytest.mark.parametrize(
    ("words", "made"),
    [
        (["demo", "--device", "--out", "out"], "report.html"),
        (["stability", "--out", "out"], "atlas.html"),
        (["bench", "chart", "--full", "--out", "out"], "chart.html"),
    ],
    ids=["demo on devices", "atlas", "chart"],
)
def test_it_ends_well_and_says_where_its_page_is(
    tmp_path: Path, words: list[str], made: str
) -> None:
    command = [sys.executable, "-m", "tactileq", *words]
    done = subprocess.run(command, cwd=tmp_path, capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    page = tmp_path / done.stdout.split()[-1]
    assert page == tmp_path / "out" / made
    assert page.stat().st_size > 10_000
