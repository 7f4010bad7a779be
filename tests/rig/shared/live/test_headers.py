"""The headers of shared memory and of the audio callback: warnings, and what they call."""

from __future__ import annotations

import re
import subprocess
from pathlib import Path

import pytest

import tactileq.modeling.rendering
import tactileq.rig.shared.live

LIVE = Path(tactileq.rig.shared.live.__file__).parent
KERNEL = Path(tactileq.modeling.rendering.__file__).parent
PROGRAM = """
#include "sound.h"
int (*callback)(const void *, void *, unsigned long, const void *, unsigned long, void *);
void begin(void) { callback = tq_sound_callback; }
"""


@pytest.mark.parametrize("standard", ["gnu11", "gnu99"])
def test_the_callback_compiles_without_a_warning_and_calls_nothing_that_waits(
    tmp_path: Path, standard: str
) -> None:
    source, target = tmp_path / "callback.c", tmp_path / "callback.o"
    source.write_text(PROGRAM)
    options = ["-O2", "-Wall", "-Wextra", "-Wpedantic", "-Werror", "-Wno-unused-function"]
    includes = [f"-I{LIVE}", f"-I{KERNEL}"]
    command = ["gcc", f"-std={standard}", "-c", *options, *includes, str(source), "-o", str(target)]
    built = subprocess.run(command, capture_output=True, text=True)
    assert built.returncode == 0, built.stderr
    symbols = subprocess.run(["nm", target], check=True, capture_output=True, text=True).stdout
    called = set(re.findall(r" U (\w+)", symbols)) - {"_GLOBAL_OFFSET_TABLE_", "__stack_chk_fail"}
    assert called <= {"clock_gettime", "memcpy", "memmove", "memset", "sqrt"}
    assert "clock_gettime" in called
