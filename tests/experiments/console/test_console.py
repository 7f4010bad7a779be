"""The console in a real PsychoPy window, operated by a real mouse and keyboard (Xvfb, xdotool)."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from collections.abc import Callable, Iterator
from contextlib import AbstractContextManager, contextmanager
from pathlib import Path
from typing import Any

import pytest

from experiments.study.study import Study
from experiments.tasks import plan_session

ROOT = Path(__file__).parents[3]
DRIVER = Path(__file__).with_name("console_session.py")


@pytest.fixture(scope="module")
def display(x_server: Callable[..., AbstractContextManager[str]]) -> Iterator[str]:
    """A small screen, which software draws sooner."""
    with x_server(size=(1280, 800)) as name:
        yield name


class Participant:
    """Hand, eyes and ears of the person at the console."""

    def __init__(self, session: subprocess.Popen[str], environment: dict[str, str]) -> None:
        self.session = session
        self.environment = environment
        self.presented: list[list[str]] = []
        self.handles: dict[str, tuple[int, int]] = {}
        self.texts: list[str] = []

    def hear(self) -> dict[str, Any]:
        line = self.session.stdout.readline()
        assert line, "the session ended without a word"
        news: dict[str, Any] = json.loads(line)
        if "presented" in news:
            self.presented.append(news["presented"])
        if "page" in news:
            self.handles, self.texts = news["handles"], news["texts"]
        return news

    def wait_for_page(self, name: str) -> None:
        while (page := self.hear().get("page")) is None:
            pass
        assert page == name

    def wait_for_surface(self) -> list[str]:
        while "presented" not in (news := self.hear()):
            pass
        surface: list[str] = news["presented"]
        return surface

    def wait_for_result(self) -> dict[str, Any]:
        while "result" not in (news := self.hear()):
            pass
        return news

    def xdotool(self, *words: object) -> None:
        subprocess.run(["xdotool", *map(str, words)], env=self.environment, check=True, timeout=20)

    def click(self, handle: str) -> None:
        self.xdotool("mousemove", *self.handles[handle], "click", 1)

    def rate(self, scale: str, value: int) -> None:
        """Click at this value of a scale."""
        (left, y), (right, _) = self.handles[f"{scale}:0"], self.handles[f"{scale}:100"]
        self.xdotool("mousemove", round(left + (right - left) * value / 100), y, "click", 1)

    def drag(self, start: tuple[int, int], end: tuple[int, int]) -> None:
        middle = [(a + b) // 2 for a, b in zip(start, end, strict=True)]
        moves = [*("mousemove", *start), *("mousedown", 1), *("mousemove", *middle)]
        self.xdotool(*moves, "mousemove", *end, "mouseup", 1)


@contextmanager
def seated(task: str, folder: Path, display: str) -> Iterator[Participant]:
    environment = {**os.environ, "DISPLAY": display, "PYTHONPATH": str(ROOT)}
    session = subprocess.Popen(
        [sys.executable, str(DRIVER), task, str(folder)],
        env=environment,
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        text=True,
    )
    try:
        yield Participant(session, environment)
    finally:
        session.kill()
        session.communicate(timeout=10)


def no_name_is_shown(texts: list[str], study: Study) -> bool:
    shown = " ".join(texts).lower()
    hidden = [*study.textures, "full", "simplified", "model"]
    return texts != [] and not any(name.lower() in shown for name in hidden)


def test_an_absolute_trial_by_mouse(tmp_path: Path, display: str, rows: Any) -> None:
    study = Study.load()
    trial = plan_session(study, task="absolute", subject=1, session=1).trials[0]
    with seated("absolute", tmp_path, display) as person:
        person.wait_for_page("message")
        person.click("confirm")
        person.wait_for_page("mount")
        assert person.presented == []
        assert f"Put the sample from tray {trial.tray} in place" in person.texts
        person.click("confirm")
        person.wait_for_page("rate")
        assert person.presented == [[trial.first_surface, trial.texture]]

        # Dragging onto a scale from outside rates nothing, so Continue stays without effect.
        for scale in ("magnitude", "frequency"):
            x, y = person.handles[f"{scale}:50"]
            person.drag((x, y + 80), (x, y))
        person.click("continue")
        person.rate("magnitude", 80)
        person.click("continue")
        # A drag that begins on the scale counts where it is let go, be it off the line.
        (left, y), (right, _) = person.handles["frequency:0"], person.handles["frequency:100"]
        person.drag((right, y), (left + (right - left) // 4, y + 60))
        # Who has felt only one of the two surfaces cannot go on.
        person.click("continue")
        other = "real" if trial.first_surface == "virtual" else "virtual"
        person.click(other)
        assert person.wait_for_surface() == [other, trial.texture]
        person.session.stdin.write("press\n")
        person.session.stdin.flush()
        assert person.wait_for_surface() == [trial.first_surface, trial.texture]
        person.click("continue")
        person.wait_for_page("mount")
        person.xdotool("key", "Escape")
        result = person.wait_for_result()
        person.session.wait(timeout=20)
    path, answered = result["result"]
    (row,) = rows(Path(path))
    assert answered == 1
    assert float(row["magnitude_similarity"]) == pytest.approx(80, abs=0.2)
    assert float(row["frequency_similarity"]) == pytest.approx(25, abs=0.2)
    assert (row["toggles"], row["simulated"]) == ("2", "true")
    assert float(row["response_time_s"]) > 0
    assert result["vibrated"]
    assert no_name_is_shown(person.texts, study)


def test_a_relative_trial_by_mouse(tmp_path: Path, display: str, rows: Any) -> None:
    study = Study.load()
    trial = plan_session(study, task="relative", subject=1, session=1).trials[0]
    with seated("relative", tmp_path, display) as person:
        person.wait_for_page("message")
        person.click("confirm")
        person.wait_for_page("mount")
        person.click("confirm")
        person.wait_for_page("choose")
        assert person.presented == [["real", trial.texture]]
        person.click("confirm")  # nothing has been chosen: no effect
        for button in (1, 7, 3):
            person.click(f"button {button}")
            assert person.wait_for_surface() == ["virtual", trial.layout[button - 1]]
        person.click("real")
        assert person.wait_for_surface() == ["real", trial.texture]
        person.click("button 5")
        assert person.wait_for_surface() == ["virtual", trial.layout[4]]
        person.click("confirm")
        person.wait_for_page("mount")
        person.xdotool("key", "Escape")
        result = person.wait_for_result()
        person.session.wait(timeout=20)
    path, answered = result["result"]
    (row,) = rows(Path(path))
    assert answered == 1
    assert row["answer"] == trial.layout[4]
    assert row["correct"] == str(int(trial.layout[4] == trial.texture))
    assert (row["layout"], row["presses"]) == ("|".join(trial.layout), "4")
    assert no_name_is_shown(person.texts, study)


OPEN = """
import sys
from tactileq.commands.session import open_console
for screen in map(int, sys.argv[1:]):
    try:
        with open_console(fullscreen=False, screen=screen) as console:
            print("open")
    except ValueError as refusal:
        print(refusal)
"""


def test_a_screen_that_is_not_there_is_refused(
    x_server: Callable[..., AbstractContextManager[str]],
) -> None:
    with x_server(screens=2, size=(1280, 800)) as name:
        environment = {**os.environ, "DISPLAY": name, "PYTHONPATH": str(ROOT)}
        opened = subprocess.run(
            [sys.executable, "-c", OPEN, "2", "-1", "0"],
            env=environment,
            capture_output=True,
            text=True,
            timeout=60,
        )
    too_high, too_low, there = opened.stdout.splitlines()
    for refusal, number in ((too_high, 2), (too_low, -1)):
        assert refusal == (
            f"expected the number of a screen (0 to 1, of 2), got {number}; choose one that is "
            "there, or connect another."
        )
    assert there == "open"
