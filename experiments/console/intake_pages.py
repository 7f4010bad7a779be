"""What a participant is asked before the first trial: consent, code, questions."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from math import ceil, floor

from tactileq.experiments.console.drawing import BLUE, CARD, CONSOLE_GREY, SMALL_HEIGHT, text
from tactileq.experiments.console.page_runner import NOTICE_Y, PageRunner
from tactileq.experiments.console.widgets import Button
from tactileq.experiments.sessions.loop.people import Intake, SessionAborted
from tactileq.experiments.study.questions import (
    MOST_DIGITS,
    MOST_LEVELS,
    NOT_SAID,
    Question,
)

ANOTHER = "the code is another person's"
COLUMN_WIDTHS = (0.6, 0.5, 0.38)  # where answers stand in one column, in two, in three
ROWS = MOST_LEVELS // len(COLUMN_WIDTHS)  # of answers below each other
NUMBER_NOTICE_Y = 0.245  # above what is typed
DECLINE_AT, DECLINE_SIZE = (0.42, -0.385), (0.42, 0.066)  # beside the button that goes on
MOST_TYPED = MOST_DIGITS + 1  # one more, so that a number can be seen to be too large
DIGIT_PLACES = {
    str(digit): ((digit - 1) % 3 - 1, -((digit - 1) // 3)) for digit in range(1, 10)
} | {"0": (0, -3)}


def consents(runner: PageRunner, version: str) -> bool:
    """Whether the participant agrees to this version of the consent form."""
    of = runner.texts.of
    return _ask(
        runner,
        "consent",
        yes=of("consent.agree"),
        no=of("consent.refuse"),
        values={"version": version},
    )


def welcome(runner: PageRunner, intake: Intake) -> dict[str, str | int]:
    """Code and questions; of a person who was here before, the code alone.

    Returns
    -------
    dict of question name to answer

    Raises
    ------
    SessionAborted
        If the code is another person's, or the participant stops.
    InputError
        If a question has no text in the language of the console.
    """
    runner.texts.require(intake.questions)
    of = runner.texts.of
    if intake.known:
        yes = _ask(
            runner, "known", yes=of("known.yes"), no=of("known.no"), values={"code": intake.code}
        )
        if not yes:
            raise SessionAborted(ANOTHER, by="participant")
        return {}
    message(runner, "code", values={"code": intake.code})
    return {question.name: answer(runner, question) for question in intake.questions}


def message(runner: PageRunner, page: str, *, values: dict[str, object]) -> None:
    """A title, a text, and a button to continue; the last page is ended by it, and by Escape."""
    of = runner.texts.of
    last = page.endswith(".closing")
    label = of("button.finish") if last else runner.texts.by_key.get(f"{page}.continue")
    proceed = runner.proceed(label, y=-0.24)
    runner.show(
        page,
        widgets=[proceed],
        decoration=[
            runner.title(of(f"{page}.title", **values), y=0.24),
            runner.body(of(f"{page}.text", **values), y=0.03),
        ],
        goes_on=proceed,
        stoppable=not last,
    )


def _ask(runner: PageRunner, page: str, *, yes: str, no: str, values: dict[str, object]) -> bool:
    """A text with two answers, neither of which has the focus or stands out at first."""
    said: list[bool] = []

    def say(agreed: bool) -> None:
        said.append(agreed)
        runner.finish()

    agree = runner.button("yes", yes, at=(-0.2, -0.24), action=lambda: say(True))
    refuse = runner.button("no", no, at=(0.2, -0.24), action=lambda: say(False))
    agree.lit = refuse.lit = False
    runner.show(
        page,
        widgets=[agree, refuse],
        decoration=[
            runner.title(runner.texts.of(f"{page}.title", **values), y=0.24),
            runner.body(runner.texts.of(f"{page}.text", **values), y=0.03),
            runner.keys(runner.texts.of("keys")),
        ],
        notice=runner.notice(NOTICE_Y),
    )
    return said[-1]


def answer(runner: PageRunner, question: Question) -> str | int:
    """The answer to one question: one of its levels, a number in its range, or `NOT_SAID`."""
    return _level(runner, question) if question.levels else _number(runner, question)


def _decline(runner: PageRunner, action: Callable[[], None]) -> Button:
    """The button of who prefers not to answer."""
    return runner.button(
        "decline",
        runner.texts.of("question.decline"),
        at=DECLINE_AT,
        size=DECLINE_SIZE,
        action=action,
        height=SMALL_HEIGHT,
    )


# --- One of several answers -----------------------------------------------------------------


def _level(runner: PageRunner, question: Question) -> str:
    picked: list[str] = []
    columns = -(-len(question.levels) // ROWS)
    width = COLUMN_WIDTHS[columns - 1]
    rows = -(-len(question.levels) // columns)
    buttons = [
        runner.button(
            f"level {level}",
            runner.texts.level(question, level),
            at=((width + 0.02) * (index // rows - (columns - 1) / 2), 0.2 - 0.088 * (index % rows)),
            size=(width, 0.074),
            action=partial(picked.append, level),
        )
        for index, level in enumerate(question.levels)
    ]
    proceed, notice = runner.proceed(), runner.notice(NOTICE_Y)
    answers = dict(zip(question.levels, buttons, strict=True))
    if not question.has_refusal:
        answers[NOT_SAID] = _decline(runner, partial(picked.append, NOT_SAID))
    for button in answers.values():
        button.then = proceed

    def update() -> None:
        proceed.needs = "" if picked else runner.texts.of("question.choose")
        notice.say(proceed.needs)
        for level, button in answers.items():
            button.lit = picked[-1:] == [level]

    runner.show(
        f"question {question.name}",
        widgets=[*answers.values(), proceed],
        decoration=[
            runner.title(runner.texts.question(question), y=0.34),
            *runner.foot(runner.texts.of("keys")),
        ],
        update=update,
        focus=buttons[0],
        goes_on=proceed,
        notice=notice,
    )
    return picked[-1]


# --- A number -------------------------------------------------------------------------------


class _Typed:
    """The digits typed so far, in a frame, unless the participant prefers not to answer."""

    def __init__(self, runner: PageRunner, question: Question) -> None:
        from psychopy import visual

        assert question.least is not None
        assert question.most is not None
        self.declined = False
        self._digits = ""
        self._least, self._most = question.least, question.most
        self._of = runner.texts.of
        at = (0.0, 0.17)
        self._frame = visual.Rect(
            runner.window,
            pos=at,
            size=(0.29, 0.075),
            units="height",
            fillColor=CARD,
            lineColor=BLUE,
            lineWidth=2,
            autoLog=False,
        )
        self._text = text(runner.window, "", at=at, height=0.046)

    @property
    def answer(self) -> int | str:
        """The number, or `NOT_SAID`; only where nothing is needed."""
        return NOT_SAID if self.declined else int(self._digits)

    @property
    def range(self) -> str:
        """What may be typed."""
        return self._of("question.range", least=f"{self._least:g}", most=f"{self._most:g}")

    @property
    def needs(self) -> str:
        """Why this is no answer; empty where it is one."""
        if self.declined:
            return ""
        if not self._digits:
            return self.range
        if int(self._digits) < self._least:
            return self._of("question.too_small", least=f"{ceil(self._least)}")
        if int(self._digits) > self._most:
            return self._of("question.too_large", most=f"{floor(self._most)}")
        return ""

    @property
    def hopeless(self) -> bool:
        """Whether no further digit can make it an answer."""
        return bool(self._digits) and not any(
            int(self._digits + "0" * more) <= self._most
            and int(self._digits + "9" * more) >= self._least
            for more in range(MOST_TYPED - len(self._digits) + 1)
        )

    def add(self, digit: str) -> None:
        """Type a digit."""
        self.declined = False
        self._digits = (self._digits + digit)[:MOST_TYPED]

    def delete(self) -> None:
        """Take the last digit back."""
        self._digits = self._digits[:-1]

    def decline(self) -> None:
        """Leave the question unanswered, unless a digit is typed after all."""
        self.declined = True
        self._digits = ""

    def draw(self) -> None:
        """The frame and the digits."""
        self._text.text = self._digits
        for part in (self._frame, self._text):
            part.draw()


def _number(runner: PageRunner, question: Question) -> int | str:
    typed = _Typed(runner, question)
    pad = _digit_pad(runner, typed)
    decline = _decline(runner, typed.decline)
    proceed, notice = runner.proceed(), runner.notice(NUMBER_NOTICE_Y)
    decline.then = proceed

    def update() -> None:
        decline.lit = typed.declined
        proceed.needs = typed.needs
        # A number that only lacks digits is no mistake yet.
        ranged = typed.needs if typed.hopeless else typed.range
        notice.say(ranged, warns=typed.hopeless)

    shortcuts = {name.removeprefix("digit "): button for name, button in pad.items()}
    delete = shortcuts.pop("delete")
    runner.show(
        f"question {question.name}",
        # Digits are typed: the pad, which is for the mouse, comes last.
        widgets=[proceed, decline, *pad.values()],
        decoration=[
            runner.title(runner.texts.question(question), y=0.34),
            typed,
            *runner.foot(runner.texts.of("keys")),
        ],
        update=update,
        goes_on=proceed,
        notice=notice,
        shortcuts={**shortcuts, "backspace": delete, "delete": delete},
    )
    return typed.answer


def _digit_pad(runner: PageRunner, typed: _Typed) -> dict[str, Button]:
    """Buttons "digit 1" … "digit 0", and "delete"."""
    pad = {
        f"digit {digit}": runner.button(
            f"digit {digit}",
            digit,
            at=(0.1 * column, 0.075 + 0.1 * row),
            size=(0.088, 0.088),
            action=partial(typed.add, digit),
        )
        for digit, (column, row) in DIGIT_PLACES.items()
    }
    pad["delete"] = runner.button(
        "delete",
        runner.texts.of("question.delete"),
        at=(0.1, 0.075 - 0.3),
        size=(0.088, 0.088),
        action=typed.delete,
        color=CONSOLE_GREY,
    )
    for button in pad.values():
        button.lit = False
    return pad
