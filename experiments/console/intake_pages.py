"""What a participant is asked before the first trial: consent, code, questions."""

from __future__ import annotations

from functools import partial

from tactileq.experiments.console.drawing import CARD, CONSOLE_GREY, CONSOLE_ORANGE, PALE, text
from tactileq.experiments.console.page_runner import PageRunner
from tactileq.experiments.console.widgets import Button
from tactileq.experiments.sessions.loop.people import Intake, SessionAborted
from tactileq.experiments.study.questions import MOST_DIGITS, MOST_LEVELS, Question

ANOTHER = "the code is another person's"
COLUMN_WIDTHS = (0.6, 0.5, 0.38)  # where answers stand in one column, in two, in three
ROWS = MOST_LEVELS // len(COLUMN_WIDTHS)  # of answers below each other
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
        focus=proceed,
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
    )
    return said[-1]


def answer(runner: PageRunner, question: Question) -> str | int:
    """The answer to one question: one of its levels, or a number in its range."""
    return _level(runner, question) if question.levels else _number(runner, question)


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
    proceed = runner.proceed()

    def update() -> None:
        proceed.enabled = bool(picked)
        for level, button in zip(question.levels, buttons, strict=True):
            button.lit = picked[-1:] == [level]

    runner.show(
        f"question {question.name}",
        widgets=[*buttons, proceed],
        decoration=[
            runner.title(runner.texts.question(question), y=0.34),
            *runner.foot(runner.texts.of("keys")),
        ],
        update=update,
    )
    return picked[-1]


# --- A number -------------------------------------------------------------------------------


class _Typed:
    """The digits typed so far, in a frame; above them what may be typed, orange where it is not."""

    def __init__(self, runner: PageRunner, *, least: float, most: float) -> None:
        from psychopy import visual

        self.digits = ""
        self._least, self._most = least, most
        asked = runner.texts.of("question.range", least=f"{least:g}", most=f"{most:g}")
        self._asked = {
            wrong: runner.remark(asked, y=0.245, color=CONSOLE_ORANGE if wrong else CONSOLE_GREY)
            for wrong in (False, True)
        }
        at = (0.0, 0.17)
        self._frame = visual.Rect(
            runner.window,
            pos=at,
            size=(0.29, 0.075),
            units="height",
            fillColor=CARD,
            lineColor=PALE,
            lineWidth=2,
            autoLog=False,
        )
        self._text = text(runner.window, "", at=at, height=0.046)

    @property
    def number(self) -> int | None:
        """None before the first digit."""
        return int(self.digits) if self.digits else None

    @property
    def inside(self) -> bool:
        """Whether the number is one that may be answered."""
        return self.number is not None and self._least <= self.number <= self._most

    @property
    def wrong(self) -> bool:
        """Whether no further digit can bring the number into the range."""
        return self.number is not None and self.number > self._least and not self.inside

    def add(self, digit: str) -> None:
        """Type a digit."""
        self.digits = (self.digits + digit)[:MOST_DIGITS]

    def delete(self) -> None:
        """Take the last digit back."""
        self.digits = self.digits[:-1]

    def draw(self) -> None:
        """The range, the frame and the digits."""
        self._text.text = self.digits
        for part in (self._asked[self.wrong], self._frame, self._text):
            part.draw()


def _number(runner: PageRunner, question: Question) -> int:
    assert question.least is not None
    assert question.most is not None
    typed = _Typed(runner, least=question.least, most=question.most)
    pad = _digit_pad(runner, typed)
    proceed = runner.proceed()

    def update() -> None:
        proceed.enabled = typed.inside

    shortcuts = {name.removeprefix("digit "): button for name, button in pad.items()}
    delete = shortcuts.pop("delete")
    runner.show(
        f"question {question.name}",
        widgets=[*pad.values(), proceed],
        decoration=[
            runner.title(runner.texts.question(question), y=0.34),
            typed,
            *runner.foot(runner.texts.of("keys")),
        ],
        update=update,
        shortcuts={**shortcuts, "backspace": delete, "delete": delete},
    )
    assert typed.number is not None
    return typed.number


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
