"""The pages of trials: two surfaces to rate, or one of several to choose."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from typing import Any

from tactileq.experiments.console.drawing import CONSOLE_ORANGE, INK, SMALL_HEIGHT, Point
from tactileq.experiments.console.page_runner import PageRunner
from tactileq.experiments.console.widgets import Button, RatingScale
from tactileq.experiments.sessions.loop.people import Choice, ChoiceTrial, RatedTrial, Rating
from tactileq.experiments.sessions.loop.surfaces import Surfaces
from tactileq.experiments.sessions.loop.task import Task

BUTTONS_PER_ROW = 7
BUTTON_PITCH, ROW_PITCH = 0.15, 0.18
SCALES_Y = {"magnitude": 0.06, "frequency": -0.165}


def rate(runner: PageRunner, trial: RatedTrial, surfaces: Surfaces) -> Rating:
    """Two rating scales, and a button for the real and for the virtual surface.

    One can go on once both surfaces have been felt and both scales have a mark.
    """
    of = runner.texts.of
    scales = {name: _scale(runner, name, surfaces) for name in SCALES_Y}
    real = _real(runner, surfaces, at=(-0.19, 0.29))
    virtual = runner.button(
        "virtual",
        of("surface.virtual"),
        at=(0.19, 0.29),
        size=(0.36, 0.078),
        action=surfaces.present_virtual,
    )
    proceed = runner.proceed()
    notice = runner.notice(-0.305)

    def update() -> None:
        shows_real = surfaces.shows_real if surfaces.started else _begins_real(trial)
        real.lit, virtual.lit = shows_real, not shows_real
        ready = surfaces.switches > 0 and all(s.rated for s in scales.values())
        proceed.needs = "" if ready else of("absolute.needed")
        notice.say(proceed.needs)

    runner.show(
        "rate",
        widgets=(real, virtual, *scales.values(), proceed),
        decoration=(
            runner.title(of("absolute.question")),
            runner.remark(of("surface.felt_now"), y=0.212),
            *(runner.card(y + 0.012, 0.2) for y in SCALES_Y.values()),
            *_mark(runner, trial),
            *runner.foot(of("absolute.keys")),
        ),
        surfaces=surfaces,
        update=update,
        focus=scales["magnitude"],
        goes_on=proceed,
        notice=notice,
        shortcuts={"r": real, "v": virtual},
    )
    return Rating(
        magnitude_similarity=scales["magnitude"].rating,
        frequency_similarity=scales["frequency"].rating,
        response_time_s=surfaces.response_time_s,
    )


def choose(runner: PageRunner, trial: ChoiceTrial, surfaces: Surfaces, *, task: Task) -> Choice:
    """Per virtual surface a numbered button to feel it and one below to choose it; one to confirm,
    and one for the real surface in tasks that have one.

    A surface can be chosen once it has been felt; feeling another one leaves the choice as it is.
    """
    of, of_task = runner.texts.of, partial(runner.texts.of_task, task.name)
    real = _real(runner, surfaces, at=(0.0, 0.3)) if task.mounts else None
    numbered = [_numbered(runner, index, surfaces) for index in range(surfaces.count)]
    answers = [_answer(runner, index, surfaces) for index in range(surfaces.count)]
    confirm = runner.proceed(of("choice.confirm"), y=-0.36)
    notice = runner.notice(-0.27)
    for button in answers:
        button.then = confirm

    def update() -> None:
        # What the page announces: the task begins with it.
        at_first = None if task.mounts or surfaces.bursts else 0
        shown = at_first if not surfaces.started else surfaces.last
        shows_real = surfaces.shows_real if surfaces.started else task.mounts
        if real is not None:
            real.lit = shows_real
        for index, button in enumerate(numbered):
            button.lit = shown == index and not shows_real
            spent = surfaces.bursts and index in surfaces.felt
            button.needs = of_task("surface.felt_now") if spent else ""
        for index, button in enumerate(answers):
            felt = index in surfaces.felt
            button.needs = "" if felt else of_task("choice.feel_first", number=index + 1)
            button.lit = surfaces.chosen == index
        said = _remark(of_task, surfaces)
        ready = surfaces.chosen is not None and _remaining(surfaces) == 0
        confirm.needs = "" if ready else said
        notice.say(said)

    reals = [] if real is None else [real]
    runner.show(
        "choose",
        widgets=(*reals, *numbered, *answers, confirm),
        decoration=(
            runner.title(of(f"{task.name}.question")),
            runner.remark(of_task("surface.felt_now"), y=0.225),
            runner.card(0.0, 0.03 + ROW_PITCH * _rows(surfaces.count)),
            *_mark(runner, trial),
            *runner.foot(of("choice.keys")),
        ),
        surfaces=surfaces,
        update=update,
        focus=numbered[0],
        goes_on=confirm,
        notice=notice,
        shortcuts={
            **{str(number): button for number, button in enumerate(numbered[:9], start=1)},
            **{f"ctrl+{number}": button for number, button in enumerate(answers[:9], start=1)},
            **({} if real is None else {"r": real}),
        },
    )
    assert surfaces.chosen is not None
    return Choice(button=surfaces.chosen, response_time_s=surfaces.response_time_s)


def _mark(runner: PageRunner, trial: RatedTrial | ChoiceTrial) -> list[Any]:
    """That a trial is for practice, if it is."""
    return runner.practice_mark() if trial.phase == "training" else []


def _begins_real(trial: RatedTrial) -> bool:
    return getattr(trial, "first_surface", "real") == "real"


def _real(runner: PageRunner, surfaces: Surfaces, *, at: tuple[float, float]) -> Button:
    return runner.button(
        "real",
        runner.texts.of("surface.real"),
        at=at,
        size=(0.36, 0.078),
        action=surfaces.present_real,
        color=CONSOLE_ORANGE,
    )


def _scale(runner: PageRunner, name: str, surfaces: Surfaces) -> RatingScale:
    of = runner.texts.of
    return RatingScale(
        runner.window,
        name,
        label=of(f"absolute.{name}"),
        ends=(of("absolute.lowest"), of("absolute.highest")),
        at=(0.0, SCALES_Y[name]),
        width=0.95,
        changed=lambda value: surfaces.note("slider", scale=name, value=round(value, 1)),
    )


def _rows(count: int) -> int:
    return -(-count // BUTTONS_PER_ROW)


def _middle(index: int, count: int) -> Point:
    """Between the two buttons of a virtual surface."""
    row, column = divmod(index, BUTTONS_PER_ROW)
    in_row = min(BUTTONS_PER_ROW, count - row * BUTTONS_PER_ROW)
    x = BUTTON_PITCH * (column - (in_row - 1) / 2)
    return x, ROW_PITCH * ((_rows(count) - 1) / 2 - row)


def _numbered(runner: PageRunner, index: int, surfaces: Surfaces) -> Button:
    x, y = _middle(index, surfaces.count)
    return runner.button(
        f"button {index + 1}",
        str(index + 1),
        at=(x, y + 0.03),
        size=(0.12, 0.096),
        action=lambda: surfaces.present_virtual(index),
    )


def _answer(runner: PageRunner, index: int, surfaces: Surfaces) -> Button:
    x, y = _middle(index, surfaces.count)
    return runner.button(
        f"answer {index + 1}",
        runner.texts.of("choice.choose"),
        at=(x, y - 0.053),
        size=(0.12, 0.046),
        action=lambda: surfaces.choose(index),
        color=INK,
        height=SMALL_HEIGHT,
    )


def _remaining(surfaces: Surfaces) -> int:
    """How many surfaces have still to be felt before one can answer."""
    return surfaces.count - len(surfaces.felt) if surfaces.feel_all else 0


def _remark(of: Callable[..., str], surfaces: Surfaces) -> str:
    """What to do next: press a number, choose, feel the rest, or confirm the choice."""
    if surfaces.chosen is not None:
        sentence = of("choice.so_far", number=surfaces.chosen + 1)
    else:
        may_confirm = surfaces.felt and _remaining(surfaces) == 0
        sentence = of("choice.choose_one" if may_confirm else "choice.press")
    if count := _remaining(surfaces):
        sentence += "\n" + of("choice.remaining", count=count)
    return sentence
