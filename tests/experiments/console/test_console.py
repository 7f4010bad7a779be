"""The console in a real PsychoPy window, worked by a real mouse and real keys (Xvfb, xdotool)."""

from __future__ import annotations

import json
import subprocess
from collections.abc import Callable, Iterator
from contextlib import AbstractContextManager, contextmanager
from pathlib import Path
from typing import Any

import pytest

from tactileq.experiments.console.languages import Texts
from tests.experiments.driven import Driven

DRIVER = Path(__file__).with_name("console_session.py")
ALL_PARTS = ("new", "training", "wait", "absolute", "rest", "relative", "oddity", "closing")
Seated = Callable[..., AbstractContextManager["Participant"]]


class Participant:
    """Hand, eyes and ears of the person at the console."""

    def __init__(self, session: subprocess.Popen[str], environment: dict[str, str]) -> None:
        self.session = session
        self.environment = environment
        self.heard: list[dict[str, Any]] = []
        self.handles: dict[str, tuple[int, int]] = {}

    def hear(self) -> dict[str, Any]:
        line = self.session.stdout.readline()
        assert line, "the session ended without a word"
        news: dict[str, Any] = json.loads(line)
        self.heard.append(news)
        self.handles = news.get("handles", self.handles)
        return news

    def wait_for(self, what: str) -> Any:
        """The next page, presentation, note or result."""
        while what not in (news := self.hear()):
            pass
        return news[what]

    def wait_for_page(self, name: str) -> None:
        assert self.wait_for("page") == name

    def wait_for_note(self, event: str) -> None:
        while self.wait_for("noted") != event:
            pass

    def say(self, line: str) -> None:
        self.session.stdin.write(line + "\n")
        self.session.stdin.flush()

    def xdotool(self, *words: object) -> None:
        subprocess.run(["xdotool", *map(str, words)], env=self.environment, check=True, timeout=500)

    def keys(self, *names: str) -> None:
        self.xdotool("key", "--delay", 30, *names)

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

    def noted(self, event: str) -> list[dict[str, Any]]:
        return [news for news in self.heard if news.get("noted") == event]


@pytest.fixture(scope="module")
def consoles(x_server: Callable[..., AbstractContextManager[str]]) -> Iterator[Driven]:
    """On small screens, which software draws sooner."""
    with x_server(screens=2, size=(1280, 800)) as display:
        shown = Driven(DRIVER, display=display)
        yield shown
        shown.close()


@contextmanager
def asked(consoles: Driven, **order: object) -> Iterator[Participant]:
    """The person at a console; the block is left with the result."""
    with consoles.window(json.dumps(order)) as session:
        person = Participant(session, consoles.environment)
        yield person
        assert "result" in person.heard[-1]


@pytest.fixture
def seated(consoles: Driven) -> Seated:
    def seat(language: str, *parts: str, done: bool = True) -> AbstractContextManager[Participant]:
        return asked(consoles, language=language, parts=parts, done=done)

    return seat


def begins_with_its_page(person: Participant, surface: str, words: str) -> bool:
    """Whether the first presentation came after the frame that announces it, and before others."""
    first = next(news for news in person.heard if "presented" in news)
    return first["presented"] == surface and words in first["shown"]


def test_a_session_by_mouse_alone(seated: Seated) -> None:
    words = Texts.load("ja").by_key
    with seated("ja", *ALL_PARTS) as person:
        person.wait_for_page("consent")
        assert words["stamp.pilot"] in person.heard[-1]["shown"]
        person.click("yes")
        person.wait_for_page("code")
        person.click("continue")
        person.wait_for_page("question age")
        person.click("digit 1")
        person.click("continue")  # 1 is no age that is asked for: no effect
        for button in ("digit 7", "decline", "digit 1", "digit 9"):
            person.click(button)
        person.click("continue")
        person.wait_for_page("question handedness")
        person.click("continue")  # nothing is chosen: no effect
        person.click("level right")
        person.click("level left")
        person.click("continue")
        person.wait_for_page("absolute.training")
        person.click("continue")
        person.wait_for_page("wait")
        person.say("ready")

        person.wait_for_page("rate")
        assert begins_with_its_page(person, "virtual", words["absolute.question"])
        # Dragging onto a scale from outside rates nothing, so Continue stays without effect.
        for scale in ("magnitude", "frequency"):
            x, y = person.handles[f"{scale}:50"]
            person.drag((x, y + 80), (x, y))
        person.click("continue")
        person.rate("magnitude", 80)
        assert person.wait_for("noted") == "slider"
        person.click("continue")
        # A drag that begins on the scale counts where it is let go, be it off the line.
        (left, y), (right, _) = person.handles["frequency:0"], person.handles["frequency:100"]
        person.drag((right, y), (left + (right - left) // 4, y + 60))
        assert person.wait_for("noted") == "slider"
        # Who has felt only one of the two surfaces cannot go on.
        person.click("continue")
        person.click("real")
        assert person.wait_for("presented") == "real"
        person.say("the rig's button")
        assert person.wait_for("presented") == "virtual"
        person.click("continue")

        person.wait_for_page("rest")
        person.click("continue")
        person.wait_for_page("choose")
        person.click("continue")  # nothing has been chosen: no effect
        person.click("answer 2")  # nor this: it has not been felt
        for button in (1, 3, 2):
            person.click(f"button {button}")
            assert person.wait_for("presented") == "virtual"
        person.click("continue")  # what was felt last is no choice: no effect
        for answer in (3, 2):
            person.click(f"answer {answer}")
            person.wait_for_note("chosen")
        person.click("real")
        assert person.wait_for("presented") == "real"
        person.click("button 1")  # the choice stays
        assert person.wait_for("presented") == "virtual"
        person.click("continue")

        person.wait_for_page("choose")
        assert "real" not in person.handles
        person.click("button 3")
        assert person.wait_for("presented") == "virtual"
        to_feel = words["choice.remaining"].format(count=2)  # the first one began by itself
        assert f"{words['choice.press']}\n{to_feel}" in person.heard[-1]["shown"]
        person.click("answer 3")
        person.wait_for_note("chosen")
        person.click("continue")  # the second has not been felt: no effect
        person.click("button 2")
        assert person.wait_for("presented") == "virtual"
        person.click("continue")
        person.wait_for_page("absolute.closing")
        person.click("continue")
        result = person.wait_for("result")
    followed = [news["followed"] for news in person.heard if "followed" in news]
    assert followed == [news["page"] for news in person.heard if "page" in news]
    answers, _, _, (magnitude, frequency, response_time_s), _, related, odd, _ = result
    assert answers == {"age": 19, "handedness": "left"}
    assert magnitude == pytest.approx(80, abs=0.2)
    assert frequency == pytest.approx(25, abs=0.2)
    assert response_time_s > 0
    assert (related, odd) == (1, 2)
    assert [note["index"] for note in person.noted("chosen")] == [2, 1, 2]
    assert [(n["scale"], n["value"]) for n in person.noted("slider")] == [
        ("magnitude", pytest.approx(magnitude, abs=0.06)),
        ("frequency", pytest.approx(frequency, abs=0.06)),
    ]


def test_a_session_by_keys_alone(seated: Seated) -> None:
    with seated("en", *ALL_PARTS) as person:
        person.wait_for_page("consent")
        person.keys(
            "Return", "space"
        )  # nothing has the focus at first: consent is given by no chance
        person.keys("Tab", "Tab", "Tab", "Tab", "shift+Tab", "shift+Tab", "shift+Tab", "space")
        person.wait_for_page("code")
        person.keys("Return")
        person.wait_for_page("question age")
        person.keys("Return", "4", "KP_2", "3", "Return", "BackSpace", "Return")
        person.wait_for_page("question handedness")
        # From the first answer to the third; once it is chosen, Enter goes on.
        person.keys("Tab", "Tab", "space", "Return")
        person.wait_for_page("absolute.training")
        person.keys("Return")
        person.wait_for_page("wait")
        person.keys("Return")  # it is not the participant who ends it
        person.say("ready")

        person.wait_for_page("rate")
        assert begins_with_its_page(person, "virtual", "How similar are the two surfaces?")
        person.keys("shift+Tab", "shift+Tab", "Return")
        assert person.wait_for("presented") == "real"
        person.keys("v")
        assert person.wait_for("presented") == "virtual"
        person.keys("r")
        assert person.wait_for("presented") == "real"
        # The first key puts the mark to the end that it comes from.
        person.keys("Tab", "Tab", "Right", "Right", "Up", "shift+Right", "Prior", "Left", "Return")
        person.keys("Tab", "Left", "Left", "Right", "Right", "Next", "Down", "shift+Left")
        person.keys("Return")
        person.wait_for_page("rest")
        person.keys("Return")

        person.wait_for_page("choose")
        person.keys("2")
        assert person.wait_for("presented") == "virtual"
        person.keys("r")
        assert person.wait_for("presented") == "real"
        person.keys("KP_3")
        assert person.wait_for("presented") == "virtual"
        # From the first number over the others to what can be chosen: 2 and 3 were felt.
        person.keys("Tab", "Tab", "Tab", "Tab", "Return")
        person.wait_for_note("chosen")
        person.keys("Return")
        person.wait_for_page("choose")
        person.keys("r", "ctrl+3")  # there is no real one; 3 has not been felt
        person.keys("3", "ctrl+3", "Return", "2", "ctrl+2", "ctrl+3", "Return")
        person.wait_for_page("absolute.closing")
        person.keys("space")
        result = person.wait_for("result")
    answers, _, _, (magnitude, frequency, _), _, related, odd, _ = result
    assert answers == {"age": 42, "handedness": "both"}
    assert (related, odd) == (2, 2)
    values: dict[str, list[float]] = {"magnitude": [], "frequency": []}
    for note in person.noted("slider"):
        values[note["scale"]].append(note["value"])
    assert values["magnitude"] == [0, 1, 2, 12, 22, 21]
    assert values["frequency"] == [100, 99, 100, 100, 90, 89, 79]
    assert (magnitude, frequency) == (21, 79)


def test_enter_alone_goes_on_where_everything_is_filled_in(seated: Seated) -> None:
    """By the mouse all is filled in, and by Enter left: it presses what is filled, not the mouse's
    last button."""
    with seated("en", "new", "training", "absolute", "rest", "relative", "closing") as person:
        person.wait_for_page("consent")
        person.keys("Return")
        person.click("yes")
        person.wait_for_page("code")
        person.keys("Return")
        person.wait_for_page("question age")
        for button in ("digit 4", "digit 2"):
            person.click(button)
        person.keys("Return")
        person.wait_for_page("question handedness")
        person.keys("Return")  # presses the first answer, which is in the frame
        person.click("level left")
        person.keys("Return")
        person.wait_for_page("absolute.training")
        person.keys("Return")
        person.wait_for_page("rate")
        for scale, value in (("magnitude", 20), ("frequency", 60)):
            person.rate(scale, value)
            person.wait_for_note("slider")
        person.click("real")
        assert person.wait_for("presented") == "real"
        person.keys("Return")
        person.wait_for_page("rest")
        person.keys("Return")
        person.wait_for_page("choose")
        person.click("button 3")
        assert person.wait_for("presented") == "virtual"
        person.keys("Return")  # nothing is chosen: no effect
        person.click("answer 3")
        person.wait_for_note("chosen")
        person.keys("Return")
        person.wait_for_page("absolute.closing")
        person.keys("Return")
        answers, _, (magnitude, *_), _, related, _ = person.wait_for("result")
    assert answers == {"age": 42, "handedness": "left"}
    assert magnitude == pytest.approx(20, abs=0.2)
    assert related == 2
    presented = [news["presented"] for news in person.heard if "presented" in news]
    assert presented == ["virtual", "real", "real", "virtual"]  # Enter repeated none


def test_who_prefers_not_to_answer_goes_on_by_mouse_and_by_keys(seated: Seated) -> None:
    with seated("en", "new") as person:
        person.wait_for_page("consent")
        person.click("yes")
        person.wait_for_page("code")
        person.click("continue")
        person.wait_for_page("question age")
        person.keys("4", "2", "Tab", "Return", "Return")  # what was typed is gone
        person.wait_for_page("question handedness")
        person.click("decline")
        person.click("continue")
        assert person.wait_for("result") == [{"age": "not said", "handedness": "not said"}]


def test_on_the_number_page_the_pad_is_reached_last(seated: Seated) -> None:
    """Who has but Tab and Enter comes to it, and who types never meets it."""
    with seated("en", "new") as person:
        person.wait_for_page("consent")
        person.keys("Tab", "Return")
        person.wait_for_page("code")
        person.keys("Return")
        person.wait_for_page("question age")
        # Tab comes to "prefer not to say", 1, 2, 3: the button that goes on is not ready.
        person.keys("Tab", "Tab", "Tab", "Tab", "Return", "Return", *["shift+Tab"] * 4, "Return")
        person.wait_for_page("question handedness")
        person.keys("Return", "Return")
        assert person.wait_for("result") == [{"age": 33, "handedness": "right"}]


def test_stopping_is_asked_again_in_silence(seated: Seated) -> None:
    with seated("en", "absolute") as person:
        person.wait_for_page("rate")
        person.rate("magnitude", 30)
        assert person.wait_for("noted") == "slider"
        # A press that is held while the question comes up counts for nothing.
        person.xdotool("mousemove", *person.handles["magnitude:100"], "mousedown", 1)
        person.keys("Escape")
        assert person.wait_for("silent")
        assert person.wait_for("noted") == "stop_asked"
        person.wait_for_page("stop")
        person.xdotool("mouseup", 1)
        person.click("go on")
        assert person.wait_for("noted") == "stop_withdrawn"
        assert person.wait_for("presented") == "virtual"
        person.wait_for_page("rate")
        person.click("stop")
        assert person.wait_for("silent")
        person.wait_for_page("stop")
        person.keys("Escape")  # who does not mean it goes on
        assert person.wait_for("presented") == "virtual"
        person.wait_for_page("rate")
        person.keys("Escape")
        person.wait_for_page("stop")
        person.click("reason discomfort")
        person.click("reason device")
        person.click("stop now")
        assert person.wait_for("result") == ["device", "participant"]
    presentations = [news for news in person.heard if "presented" in news]
    assert [news["presented"] for news in presentations] == ["virtual"] * 3
    assert [note["value"] for note in person.noted("slider")] == [pytest.approx(30, abs=0.2)]


def test_nobody_has_to_give_a_reason(seated: Seated) -> None:
    with seated("en", "absolute") as person:
        person.wait_for_page("rate")
        person.click("stop")
        person.wait_for_page("stop")
        assert next(name for name in person.handles if name.startswith("reason")) == (
            "reason not stated"
        )
        person.click("stop now")
        assert person.wait_for("result") == ["not stated", "participant"]


def test_before_the_first_trial_nobody_is_asked_for_a_reason(seated: Seated) -> None:
    with seated("en", "new", done=False) as person:
        person.wait_for_page("consent")
        person.click("stop")
        person.wait_for_page("stop")
        assert not [name for name in person.handles if name.startswith("reason")]
        person.click("stop now")
        assert person.wait_for("result") == ["not stated", "participant"]


def test_on_the_last_page_there_is_nothing_to_stop(seated: Seated) -> None:
    with seated("en", "closing") as person:
        person.wait_for_page("absolute.closing")
        assert list(person.handles) == ["continue"]
        person.keys("Escape")
        assert person.wait_for("result") == [None]
    assert not person.noted("stop_asked")


def test_who_refuses_or_has_another_code_ends_the_session(seated: Seated) -> None:
    with seated("en", "new") as person:
        person.wait_for_page("consent")
        person.click("no")
        assert person.wait_for("result") == ["consent refused"]
    with seated("ja", "known") as person:
        person.wait_for_page("known")
        person.keys("Tab", "Tab", "Return")
        assert person.wait_for("result") == ["the code is another person's", "participant"]


def test_who_is_known_is_asked_for_the_code_alone(seated: Seated) -> None:
    with seated("en", "known", "wait") as person:
        person.wait_for_page("known")
        assert "Is TAKI-46 your code?" in person.heard[-1]["shown"]
        person.click("yes")
        person.wait_for_page("wait")
        person.say("stop")
        assert person.wait_for("result") == ["the rig is broken", "experimenter"]


def test_a_screen_that_is_not_there_is_refused(consoles: Driven) -> None:
    with asked(consoles, screens=[2, -1, 0]) as session:
        too_high, too_low, there = session.wait_for("result")
    for refusal, number in ((too_high, 2), (too_low, -1)):
        assert refusal == (
            f"expected the number of a screen (0 to 1, of 2), got {number}; choose an existing "
            "one, or connect another."
        )
    assert there == [1280, 800]  # more was asked for than the screen shows
