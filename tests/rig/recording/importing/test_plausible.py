"""What an import takes for a slip: what is told, what is passed over."""

from __future__ import annotations

import numpy as np
import pytest

from tactileq.modeling import Recording
from tactileq.rig.recording.importing.plausible import doubts_about
from tactileq.stimuli.planted.textures import CATALOGUE, planted_texture, record_texture

NOISE = np.random.default_rng(7).standard_normal(2000)


def record(
    level_g: float = 0.2,
    *,
    speed_mm_s: float = 100.0,
    force_n: float = 1.0,
    constant_g: float = 0.0,
    unit: str = "g",
) -> Recording:
    samples = level_g * (NOISE - NOISE.mean()) / NOISE.std() + constant_g
    return Recording(samples, 3200.0, speed_mm_s, force_n, "oak", unit=unit)


@pytest.mark.parametrize("name", list(CATALOGUE))
def test_planted_textures_raise_no_doubt(name: str) -> None:
    recordings = record_texture(planted_texture(name), duration_s=0.1)
    assert {doubts_about(one, "a") for one in recordings} == {()}


@pytest.mark.parametrize("force_n", [0.0, 0.05, 8.34, 30.0])
@pytest.mark.parametrize("speed_mm_s", [0.0, 3.0, 11.4, 307.9, 1500.0])
@pytest.mark.parametrize("level_g", [0.0083, 2.111, 8.0])
def test_what_real_surfaces_have_raises_no_doubt(
    level_g: float, speed_mm_s: float, force_n: float
) -> None:
    """The extremes of 1232 conditions of 100 measured textures, and the ends of the ranges."""
    one = record(0.9999 * level_g, speed_mm_s=speed_mm_s, force_n=force_n, constant_g=-1.2)
    for unit in ("g", "mg", "m/s2"):
        assert doubts_about(one, "a", unit=unit) == ()
    for scale in (0.1, 1, 16.0, 500.0, 2000):
        assert doubts_about(one, "a", g_per_fullscale=scale) == ()


@pytest.mark.parametrize(
    ("speed_mm_s", "force_n", "reading"),
    [
        (1.5, 160.0, "or 160 mm/s and 1.5 N with the columns swapped"),
        (0.1, 400.0, "or 400 mm/s and 0.1 N with the columns swapped"),
        (0.5, 1.5, "or 500 mm/s and 1.5 N with the speed in m/s"),
        (160.0, 1500.0, "or 160 mm/s and 1.5 N with the force in mN"),
        (0.1, 9000.0, "or 100 mm/s and 9 N with m/s and mN"),
        (0.0, 160.0, "or 160 mm/s and 0 N with the columns swapped"),
        (9e4, 9e3, "9000 N; correct them"),
    ],
)
def test_conditions_that_no_hand_has_are_told_with_their_other_reading(
    speed_mm_s: float, force_n: float, reading: str
) -> None:
    [told] = doubts_about(record(speed_mm_s=speed_mm_s, force_n=force_n), "a.wav")
    assert told.startswith("a.wav: expected a speed from 3 to 1500 mm/s and a force from 0.01 to")
    assert f"got {speed_mm_s:g} mm/s and {force_n:g} N" in told
    assert reading in told


@pytest.mark.parametrize(
    ("scale", "reading"),
    [
        (1e6, "or 1000 g where 1e+06 is in mg"),
        (16_000.0, "or 1632 g where 16000 is in m/s²"),
        (0.001907349, "or 62.5 g where 0.00190735 is per count of 16 bits"),
        (1e-6, "or 8.389 g where 1e-06 is per count of 24 bits"),
        (1e-9, "got 1e-09 g; correct"),
    ],
)
def test_scales_that_no_sensor_has_are_told_with_their_other_reading(
    scale: float, reading: str
) -> None:
    [told] = doubts_about(record(0.01 * scale), "a.wav", g_per_fullscale=scale)
    assert "expected 0.1 to 2000 g per full scale" in told
    assert reading in told


@pytest.mark.parametrize(
    ("level_g", "unit", "reading"),
    [
        (15.3, "g", "got 15.3 g with its numbers in g, or 1.56 g with its numbers in m/s²"),
        (200.0, "g", "or 0.2 g with its numbers in mg"),
        (5e-5, "mg", "got 5e-05 g with its numbers in mg, or 0.05 g with its numbers in g"),
        (1e9, "g", "got 1e+09 g with its numbers in g; correct"),
    ],
)
def test_levels_that_no_surface_has_are_told_with_their_other_reading(
    level_g: float, unit: str, reading: str
) -> None:
    [told] = doubts_about(record(level_g), "a.csv", unit=unit)
    assert "expected a vibration from 0.0001 to 8 g RMS" in told
    assert reading in told


def test_a_level_may_follow_from_a_scale_that_is_wrong_by_itself() -> None:
    [told] = doubts_about(record(30.0), "a.wav", g_per_fullscale=157.0)
    assert "got 30 g with g per full scale in g, or 3.06 g with g per full scale in m/s²" in told


def test_without_contact_or_unit_levels_are_as_they_are() -> None:
    assert doubts_about(record(1e-7, force_n=0.0), "a") == ()
    assert doubts_about(record(1e4, unit="arbitrary"), "a", unit="arbitrary") == ()


@pytest.mark.parametrize("constant", [9.81, -9.81, 4.0])
def test_gravity_in_m_s2_under_g_is_told(constant: float) -> None:
    one = record(0.3, constant_g=constant)
    [told] = doubts_about(one, "a.csv")
    assert "expected a constant part of at most 1.5 g" in told
    assert (
        f"got {abs(constant):g} g with its numbers in g, or {abs(constant) / 9.80665:.3g} g" in told
    )
    assert doubts_about(one, "a.csv", unit="m/s2") == ()
