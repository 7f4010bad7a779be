"""Objects in a notebook: one line, whatever they hold."""

from __future__ import annotations

import numpy as np
import pytest

import tactileq as tq

MODEL = tq.planted_texture("canvas")
RECORDS = tq.record_texture(MODEL, duration_s=0.2)


@pytest.mark.parametrize("samples", [100, 5000, 1_000_000])
def test_a_recording_of_any_length(samples: int) -> None:
    shown = repr(tq.Recording(np.linspace(-1, 1, samples), 5000.0, 120, 1.5, "oak"))
    assert "\n" not in shown
    assert len(shown) < 150
    assert shown.startswith("Recording(samples=")
    for fact in ("speed_mm_s=120", "force_n=1.5", "'oak'"):
        assert fact in shown
    assert "simulated" not in shown  # what is as usual says nothing


@pytest.mark.parametrize(
    "whole",
    [
        *(RECORDS, RECORDS.recordings[0], tq.spectrum(RECORDS.recordings[0])),
        *(MODEL, MODEL.peq(100, 1), tq.regressed(MODEL), tq.Renderer(MODEL)),
        *(tq.fit_ar(RECORDS, order=4), tq.Threshold.shipped("codec")),
        tq.simplify(MODEL, tq.Threshold.shipped("codec")),
        tq.TextureResult(RECORDS, MODEL, tq.simplify(MODEL, tq.Threshold.shipped("codec"))),
        tq.Study(
            name="x" * 1000, seed=1, textures=("oak", "cork"), trays={"oak": "A", "cork": "B"}
        ),
    ],
    ids=lambda whole: type(whole).__name__,
)
def test_what_the_public_face_gives_is_shown_on_one_line(whole: object) -> None:
    shown = repr(whole)
    assert "\n" not in shown
    assert len(shown) < 500
    assert type(whole).__name__ in shown
    if getattr(whole, "simulated", False):
        assert "simulated" in shown
