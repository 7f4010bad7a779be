"""Which tests need a package that the core does not install, and are skipped without it.

`make test-core` runs without these packages, and `make test` with all of them and no test skipped.
"""

from __future__ import annotations

from collections.abc import Iterable
from importlib.util import find_spec
from pathlib import Path

import pytest

ROOT = Path(__file__).parent.parent
# Module to files, and to single tests of files that otherwise run.
NEEDING = {
    "psychopy": (
        "experiments/console/test_console.py",
        "experiments/console/test_screens.py",
        "experiments/console/test_selftest.py",
        "experiments/feel/test_window.py",
        "end_to_end/test_feel_command.py",
        "end_to_end/test_session_on_a_rig.py",
        "end_to_end/test_session_command.py::test_the_self_test_times_screen_rig_and_disk",
        "end_to_end/test_session_command.py::test_a_session_that_is_ended_by_a_signal_goes_on",
    ),
    "sounddevice": (
        "end_to_end/test_record_by_hand.py",
        "end_to_end/test_rig_calibration.py",
        "end_to_end/test_rig_monitor.py",
        "end_to_end/test_rig_play.py",
        "experiments/feel/test_opening.py",
        "rig/recording/capture/test_input.py",
        "rig/desk",
        "end_to_end/test_force_rig.py::test_a_session_with_a_wall",
        "rig/devices/sound/test_output.py",
        "rig/machines/force/test_processes.py::test_a_signal_to_all_processes",
        "rig/machines/force/test_processes.py::test_no_process_of_a_session",
        "rig/machines/force/test_processes.py::test_the_sound_process",
        "rig/devices/sound/test_signals.py::test_what_is_not_compensated_yet",
        "rig/desk/test_inventory.py",
    ),
    "cobs": (
        "end_to_end/test_demo_device.py",
        "end_to_end/test_device_rig.py",
        "rig/desk/test_device_twin.py",
        "rig/machines/board",
        "rig/machines/device",
        "rig/shared/wire",
        "test_docs_tables.py",
    ),
    "yaml": (
        "benches/recorder",
        "end_to_end/test_inputs.py",
        "end_to_end/test_mutated_files.py",
        "end_to_end/test_record_on_recorder.py",
        "rig/machines/recorder",
        "test_described_files.py",
        "test_house.py::test_files_and_names_that_pages_mention",
    ),
    "serial": (
        "rig/devices/hand/test_evdev.py::test_serial_ports",
        "rig/devices/hand/test_serial_sensor.py",
        "rig/shared/live/test_hand.py",
    ),
    "plotly": (
        "end_to_end/test_bench_chart.py",
        "benches/chart/test_chart.py::test_the_page",
    ),
    "distributed": ("end_to_end/test_power_command.py::test_dask",),
    "importlinter": ("test_rooms.py",),
    "bids_validator_deno": (
        "experiments/sessions/bids/test_bids.py::test_the_validator",
        "end_to_end/test_publish_command.py",
    ),
    "rocrate": ("end_to_end/test_publish_command.py",),
}
LACKING = {module: tests for module, tests in NEEDING.items() if find_spec(module) is None}


def is_to_collect(path: Path) -> bool:
    """Whether a file of tests can be imported: it needs nothing that is missing."""
    return not any(_lies_in(f"{_of_tests(path)}::", tests) for tests in LACKING.values())


def skip_what_lacks_packages(items: Iterable[pytest.Item]) -> None:
    """Mark single tests whose package is missing."""
    for item in items:
        name = f"{_of_tests(item.path)}::{item.name}"
        for module, tests in LACKING.items():
            if _lies_in(name, tests):
                item.add_marker(pytest.mark.skip(reason=f"needs {module}"))


def not_collected() -> str:
    """A line on the files that are left out; empty where nothing is missing."""
    left_out = ", ".join(f"{len(tests)} of {module}" for module, tests in LACKING.items())
    return f"without these packages, files or tests left out: {left_out}" if left_out else ""


def _of_tests(path: Path) -> str:
    return path.relative_to(ROOT / "tests").as_posix()


def _lies_in(name: str, tests: Iterable[str]) -> bool:
    return any(
        name.startswith((f"{test}::", f"{test}/") if "::" not in test else test) for test in tests
    )
