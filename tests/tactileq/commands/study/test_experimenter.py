"""The experimenter's terminal: what it asks, what confirms, what stops a session."""

from __future__ import annotations

import io
import os
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import TextIO

import pytest
from rich.console import Console

from tactileq.commands.study.experimenter import Terminal
from tactileq.experiments.sessions.loop.people import ProgressReport, SessionAborted
from tests.refusals import refused
from tests.rig.waiting import wait_until


@dataclass
class Desk:
    """A terminal, what was typed into it and what it shows."""

    terminal: Terminal
    keys: TextIO
    paper: io.StringIO

    def type(self, line: str) -> None:
        self.keys.write(line + "\n")
        self.keys.flush()

    def typed(self, line: str) -> None:
        """Type, and wait until the terminal has read it."""
        self.type(line)
        wait_until(lambda: not self.terminal._typed.empty())

    @property
    def shown(self) -> str:
        return self.paper.getvalue()


@pytest.fixture
def desk() -> Iterator[Desk]:
    reading, writing = os.pipe()
    paper = io.StringIO()
    with os.fdopen(reading) as lines, os.fdopen(writing, "w") as keys:
        console = Console(file=paper, width=200, highlight=False)
        yield Desk(Terminal(lines, console=console), keys, paper)
        if not keys.closed:
            keys.close()  # ends the reading


def ready(desk: Desk) -> Callable[[], bool]:
    return desk.terminal.ready


def test_a_sample_is_asked_for_by_its_tray_and_enter_confirms_it(desk: Desk) -> None:
    desk.terminal.ask_mount("C")
    assert "Tray C: put its sample in place, then press Enter" in desk.shown
    assert not desk.terminal.ready()
    desk.type("")
    wait_until(ready(desk))
    assert not desk.terminal.ready()  # one line confirms once


def test_labels_and_sentences_are_shown_as_they_stand(desk: Desk) -> None:
    desk.terminal.ask_mount("[b2]")
    desk.terminal.call("expected a port, got [/dev/ttyACM0].")
    problem = "plug [/x] in."
    desk.terminal.report(
        ProgressReport(phase="main", done=1, of=2, minutes_left=None, problems=(problem,))
    )
    assert "Tray [b2]:" in desk.shown
    assert "got [/dev/ttyACM0]." in desk.shown
    assert problem in desk.shown


def test_the_page_is_shown_and_that_an_answer_came(desk: Desk) -> None:
    for page in ("consent", "question age", "absolute.training", "wait", "rate", "stop"):
        desk.terminal.page(page)
    desk.terminal.answered()
    shown = desk.shown.splitlines()
    assert len(set(shown)) == len(shown) == 7
    assert "age" in shown[1]
    assert "training" in shown[2]
    assert "answer" in shown[-1]


def test_where_nothing_is_mounted_only_a_stop_holds_the_session_up(desk: Desk) -> None:
    desk.terminal.go_on()
    assert desk.terminal.ready()
    desk.typed("stop")
    desk.terminal.go_on()
    assert not desk.terminal.ready()
    desk.typed("late")
    with pytest.raises(SessionAborted, match="late"):
        desk.terminal.ready()


def test_an_enter_from_before_confirms_nothing(desk: Desk) -> None:
    desk.typed("")
    desk.terminal.ask_mount("C")
    assert not desk.terminal.ready()
    desk.type("")
    wait_until(ready(desk))


@pytest.mark.parametrize("early", [True, False])
def test_stop_asks_for_a_reason_and_ends_the_session(desk: Desk, early: bool) -> None:
    if early:  # while a trial went on
        desk.typed("Stop")
    desk.terminal.ask_mount("C")
    if not early:
        desk.typed("stop")
    assert not desk.terminal.ready()
    assert "Why? (one line, then Enter)" in desk.shown
    desk.typed("fire alarm")
    with pytest.raises(SessionAborted, match="fire alarm") as aborted:
        desk.terminal.ready()
    assert aborted.value.by == "experimenter"


def test_a_terminal_that_is_closed_ends_the_session(desk: Desk) -> None:
    desk.terminal.ask_mount("C")
    desk.keys.close()

    wait_until(lambda: not desk.terminal._typed.empty())
    with refused(SessionAborted, names=["terminal", "closed"]):
        desk.terminal.ready()


def test_what_failed_is_told_and_confirmed(desk: Desk) -> None:
    desk.terminal.call("expected a sound process that plays, got none; it was started again.")
    assert "The rig failed in this trial. expected a sound process" in desk.shown
    desk.type("")
    wait_until(ready(desk))


@pytest.mark.parametrize(
    ("standing", "shown"),
    [
        (
            ProgressReport(phase="training", done=0, of=14, minutes_left=None, problems=()),
            "training · rig: ready",
        ),
        (
            ProgressReport(phase="main", done=5, of=14, minutes_left=7.6, problems=()),
            "5 of 14 trials done · about 8 min left · rig: ready",
        ),
        (
            ProgressReport(
                phase="main", done=13, of=14, minutes_left=0.2, problems=("no hand; plug it in.",)
            ),
            "13 of 14 trials done · about 1 min left · rig: no hand; plug it in.",
        ),
    ],
)
def test_how_far_the_session_is_and_how_the_rig_is(
    desk: Desk, standing: ProgressReport, shown: str
) -> None:
    desk.terminal.report(standing)
    assert desk.shown.strip() == shown
