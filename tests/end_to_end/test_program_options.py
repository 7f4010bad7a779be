"""What is asked of the program itself: its version, and what a shell may complete."""

from __future__ import annotations

import os
import subprocess
import sys
import tomllib
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
# As the console script that pip installs.
SCRIPT = "import sys; sys.argv[0] = 'tactileq'; from tactileq.app import main; main()"


def test_version_is_that_of_the_project(main) -> None:
    project = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
    told = main("--version")
    assert (told.returncode, told.stdout) == (0, f"tactileq {project['version']}\n")


@pytest.mark.parametrize(
    ("words", "expected"),
    [
        ("tactileq im", {"import"}),
        ("tactileq import ", {"csv", "hatt", "wav"}),
        ("tactileq import wav --ch", {"--channel"}),
        ("tactileq import hatt --own", {"--own-conditions"}),
        ("tactileq import csv --axis ", {"x", "y", "z", "dft321"}),
    ],
)
def test_a_shell_completes_commands_options_and_choices(words: str, expected: set[str]) -> None:
    environment = {
        **os.environ,
        "_TACTILEQ_COMPLETE": "complete_bash",
        "COMP_WORDS": words,
        "COMP_CWORD": str(len(words.split(" ")) - 1),
    }
    asked = subprocess.run(
        [sys.executable, "-c", SCRIPT], env=environment, capture_output=True, text=True, timeout=500
    )
    assert set(asked.stdout.split()) == expected, asked.stderr
