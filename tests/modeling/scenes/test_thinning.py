"""Fewer nodes: what a thinned model tells, and how it ends."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from tactileq.modeling import TextureModel
from tactileq.modeling.scenes.hands import HandRange
from tactileq.modeling.scenes.places import places_of
from tactileq.modeling.scenes.restricting import cut, played, thinned

ModelMaker = Callable[..., TextureModel]
# Ends that single precision may not tell apart count once; others are kept as they are.
SHARE = st.integers(0, 10_000).map(lambda parts: parts / 10_000)


@settings(max_examples=20)
@given(data=st.data(), blending=st.sampled_from(["linear", "logarithmic"]))
def test_a_thinned_model_tells_what_its_nodes_tell_as_far_as_the_scene_reaches(
    data: st.DataObject, blending: str, varied_model: ModelMaker
) -> None:
    full = played(varied_model(data.draw(st.integers(0, 9)), blending=blending))
    axes = full.speeds_mm_s, full.forces_n
    shares = [sorted(data.draw(st.tuples(SHARE, SHARE))) for _ in axes]
    ends = [
        tuple(np.clip(axis[0] + np.array(pair) * np.ptp(axis), axis[0], axis[-1]).tolist())
        for axis, pair in zip(axes, shares, strict=True)
    ]
    places = places_of(full, HandRange(speed_mm_s=ends[0], force_n=ends[1]))
    nodes = []
    for axis in axes:
        inner = data.draw(st.sets(st.integers(1, axis.size - 2)))
        nodes.append((0, *sorted(inner), axis.size - 1))
    found = thinned(full, places, *nodes)
    assert found.blending == "linear"
    for axis, end in zip((found.speeds_mm_s, found.forces_n), ends, strict=True):
        assert (axis[0], axis[-1]) == end
    values = full.table.values[np.ix_(*nodes)]
    hand = [np.array([data.draw(st.floats(*end)) for _ in range(3)]) for end in ends]
    for axis, (at, chosen) in enumerate(zip(axes, nodes, strict=True)):
        units = np.eye(len(chosen))
        weights = np.array([np.interp(hand[axis], at[list(chosen)], unit) for unit in units])
        values = np.moveaxis(np.tensordot(weights.T, values, (1, axis)), 0, axis)
    told = found.parameters(hand[0], hand[1])
    together = np.concatenate([told.noise_gain[:, None], *told[1:]], axis=1)
    assert together == pytest.approx(values[range(3), range(3)], rel=1e-9, abs=1e-12)


def test_a_cut_model_tells_the_same_within_the_scene(varied_model: ModelMaker) -> None:
    full = varied_model(0)
    places = places_of(full, HandRange(speed_mm_s=(100, 250), force_n=(0.7, 2)))
    shorter = cut(full, places)
    rng = np.random.default_rng(0)
    hand = rng.uniform(100, 250, 50), rng.uniform(0.7, 2, 50)
    for ours, theirs in zip(shorter.parameters(*hand), full.parameters(*hand), strict=True):
        assert ours == pytest.approx(theirs, rel=1e-9)
    assert shorter.speeds_mm_s.tolist() == [100, 150, 250]
    assert shorter.forces_n.tolist() == [0.7, 1.5, 2]
