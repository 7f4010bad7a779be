"""Nothing that the kernel keeps from sample to sample dies away among the subnormal numbers."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from tactileq.modeling import Compensation, Limits, Renderer
from tactileq.modeling.rendering.compiled import Call
from tactileq.stimuli.planted.textures import planted_texture

pytestmark = pytest.mark.skipif(Call is None, reason="no kernel was compiled")
RATE_HZ = 5000


def renderer(single: bool, update_samples: int = 5) -> Renderer:
    return Renderer(
        planted_texture("canvas"),
        seed=1,
        update_samples=update_samples,
        limits=Limits(peak=0.5, rms=0.2, rms_window_s=0.5, duration_s=0.4),
        compensation=Compensation(
            frequency_hz=80.0, bandwidth_hz=60.0, height=3.0, rate_hz=float(RATE_HZ)
        ),
        single=single,
    )


def kept(made: Renderer) -> dict[str, np.ndarray]:
    """Every real number of a stream's state and memory."""
    engine: Any = made._engine
    found = {
        name: np.array(getattr(structure, name))
        for kind, structure in {
            "tq_state": engine._state,
            "tq_followed": engine._state.hand,
        }.items()
        for name, field in engine._ffi.typeof(kind).fields
        if field.type.cname in ("double", "float")
    }
    found["memory"] = np.frombuffer(engine._ffi.buffer(engine._memory), dtype=engine._real)
    return found


def subnormal(made: Renderer) -> list[str]:
    smallest = np.finfo(np.float32 if made.plan.single else np.float64).tiny
    return [name for name, x in kept(made).items() if ((x != 0) & (np.abs(x) < smallest)).any()]


def easing(to_mm_s: float, to_n: float) -> tuple[np.ndarray, np.ndarray]:
    """Half a second of a smooth motion that comes to a hold."""
    share = 0.5 + 0.5 * np.cos(np.linspace(0, np.pi, RATE_HZ // 2))
    return to_mm_s + (250 - to_mm_s) * share, to_n + (2 - to_n) * share


@pytest.mark.parametrize("update_samples", [5, 32])
@pytest.mark.parametrize(("speed", "force"), [(120.0, 1.0), (0.0, 1.0), (120.0, 0.0), (0.0, 0.0)])
@pytest.mark.parametrize("single", [False, True])
def test_after_ten_seconds_held(
    single: bool, speed: float, force: float, update_samples: int
) -> None:
    made = renderer(single, update_samples)
    made.render(*easing(speed, force))
    for _ in range(10):
        made.render(speed, force, samples=RATE_HZ)
        assert subnormal(made) == []
    assert kept(made)["speed_slope"] == kept(made)["force_slope"] == 0


@pytest.mark.parametrize("single", [False, True])
def test_after_a_thousand_seconds_of_silence(single: bool) -> None:
    made = renderer(single)
    loud = made.render(150.0, 2.0, samples=RATE_HZ)
    assert np.abs(loud).max() > 0.1
    assert kept(made)["mean_square"] > 0
    for _ in range(1000):
        silence = made.render(0.0, 2.0, samples=RATE_HZ)
        assert subnormal(made) == []
    assert not silence.any()
    assert kept(made)["mean_square"] == 0


@pytest.mark.parametrize("single", [False, True])
def test_a_hand_that_comes_to_rest_exponentially(single: bool) -> None:
    """Readings that a filter makes die away, too, until they are subnormal themselves."""
    made = renderer(single)
    speed = 200 * np.exp(-np.arange(4 * RATE_HZ) / 20)
    for block in np.split(speed, 400):
        made.render(block, np.full(block.size, 2.0))
        assert subnormal(made) == []


def test_what_is_left_out_is_below_every_rounding() -> None:
    """With and without 10 s of rest before: the same stroke sounds the same to 1e-9 of its peak."""
    stroke = 200 * np.sin(np.linspace(0, 20, RATE_HZ)), np.full(RATE_HZ, 2.0)
    rested, steady = (Renderer(planted_texture("canvas"), seed=4) for _ in range(2))
    rested.render(1e-10, 2.0, samples=RATE_HZ)  # slower than what counts as moving
    steady.render(0.0, 2.0, samples=RATE_HZ)
    found, expected = rested.render(*stroke), steady.render(*stroke)
    assert np.array_equal(found, expected)
