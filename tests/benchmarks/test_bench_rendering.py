"""How long many streams take side by side, and one at a time."""

from __future__ import annotations

import os
from collections.abc import Iterator
from functools import partial
from typing import Any

import numpy as np
import pytest
from pytest_benchmark.fixture import BenchmarkFixture

from tactileq.modeling import Renderer, TextureModel, render_many
from tactileq.modeling.arrays import Floats
from tactileq.modeling.hand import Hand
from tactileq.stimuli.planted.textures import planted_texture

STREAMS = 64
SECONDS = 2
# Output rate (Hz) and samples from one update to the next.
SETTINGS = [(5000.0, 5), (48000.0, 48)]


@pytest.fixture
def one_core() -> Iterator[None]:
    """Only one core may be used."""
    before = os.sched_getaffinity(0)
    os.sched_setaffinity(0, {max(before)})
    yield
    os.sched_setaffinity(0, before)


def strokes(rate_hz: float) -> list[Hand]:
    """As many as there are streams, each its own; to and fro about once a second, 0.5 to 2.9 N."""
    time_s = np.arange(SECONDS * round(rate_hz)) / rate_hz
    return [
        Hand(
            220 * np.sin(2 * np.pi * (0.8 + number / STREAMS) * time_s + number),
            1.7 + 1.2 * np.sin(2 * np.pi * (0.5 + number / STREAMS) * time_s),
        )
        for number in range(STREAMS)
    ]


def one_at_a_time(model: TextureModel, hands: list[Hand], **options: Any) -> list[Floats]:
    return [
        Renderer(model, seed=number, **options).render(*hand) for number, hand in enumerate(hands)
    ]


def side_by_side(model: TextureModel, hands: list[Hand], **options: Any) -> list[Floats]:
    return render_many([model] * STREAMS, hands, seeds=range(STREAMS), **options)


RENDERERS = {
    "Renderer, one at a time": one_at_a_time,
    "render_many": side_by_side,
}


def time_streams(
    benchmark: BenchmarkFixture, name: str, setting: tuple[float, int], *, where: str
) -> bool:
    """Times three layers under strokes; whether the first and the last signal are right."""
    options = dict(zip(("rate_hz", "update_samples"), setting, strict=True))
    model, hands = planted_texture("aluminum"), strokes(setting[0])
    benchmark.group = f"{STREAMS} streams at {setting[0]:.0f} Hz, updates every {setting[1]}"
    benchmark.extra_info["what"] = f"{name}, {where}"
    render = partial(RENDERERS[name], model, hands, **options)
    signals = benchmark.pedantic(render, rounds=7)
    alone = {
        number: Renderer(model, seed=number, **options).render(*hands[number])
        for number in (0, STREAMS - 1)
    }
    return all(np.array_equal(signals[number], signal) for number, signal in alone.items())


@pytest.mark.parametrize("setting", SETTINGS)
@pytest.mark.parametrize("name", RENDERERS)
@pytest.mark.usefixtures("one_core")
def test_streams_on_one_core(
    benchmark: BenchmarkFixture, name: str, setting: tuple[float, int]
) -> None:
    if RENDERERS[name] is one_at_a_time:
        benchmark.extra_info["rival"] = True
    assert time_streams(benchmark, name, setting, where="one core")


@pytest.mark.parametrize("setting", SETTINGS)
def test_streams_on_all_cores(benchmark: BenchmarkFixture, setting: tuple[float, int]) -> None:
    assert time_streams(benchmark, "render_many", setting, where="all cores")
