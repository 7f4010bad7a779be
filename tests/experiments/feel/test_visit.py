"""What a visitor's keys ask of the rig."""

from __future__ import annotations

from dataclasses import dataclass, field

import pytest

from tactileq.experiments.feel.rigs import NO_HAND, HandNow
from tactileq.experiments.feel.textures import Texture
from tactileq.experiments.feel.visit import Visit
from tactileq.modeling import Threshold, simplify
from tactileq.modeling.models.loading import Layered
from tactileq.stimuli.planted.textures import planted_texture


@dataclass
class NotingRig:
    """Notes what it is asked for."""

    notes: tuple[str, ...] = ()
    asked: list[object] = field(default_factory=list)
    halted: bool = False
    armed: int = 0

    def arm(self) -> None:
        self.armed += 1

    def present_model(self, model: Layered) -> None:
        self.asked.append((model.texture, model.n_layers))

    def silence(self) -> None:
        self.asked.append("silence")

    def mask(self, on: bool) -> None:
        self.asked.append(on)

    def point(self, x: float, y: float, *, inside: bool) -> None:
        pass

    def hand(self) -> HandNow:
        return NO_HAND

    def output(self) -> None:
        return None

    def take_faults(self) -> tuple[str, ...]:
        return ()


@pytest.fixture
def visit() -> Visit:
    canvas = planted_texture("canvas")
    fewer = simplify(canvas, Threshold.shipped("codec"), criterion="paper-fft").model
    textures = (
        Texture(full=canvas, simplified=fewer),
        Texture(full=planted_texture("PVC")),
        Texture(full=planted_texture("MDF")),
    )
    return Visit(textures, NotingRig())


def asked(visit: Visit, *keys: str) -> list[object]:
    """What the rig was asked for by these keys."""
    visit.rig.asked.clear()
    for key in keys:
        visit.press(key)
    return list(visit.rig.asked)


def test_keys_switch_textures(visit: Visit) -> None:
    assert asked(visit, "2", "3") == [("PVC", 4), ("MDF", 3)]
    assert asked(visit, "right", "left", "left") == [("canvas", 4), ("MDF", 3), ("PVC", 4)]
    assert asked(visit, "down", "up") == [("MDF", 3), ("PVC", 4)]
    assert asked(visit, "4", "x", "0") == []
    assert visit.texture.name == "PVC"


def test_a_key_switches_between_full_and_simplified(visit: Visit) -> None:
    visit.play()
    assert asked(visit, "f", "f") == [("canvas", 1), ("canvas", 4)]
    assert asked(visit, "f", "2") == [("canvas", 1), ("PVC", 4)]
    # What has no simplified model stays as it is, and the wish for one holds for the next texture.
    assert asked(visit, "1") == [("canvas", 1)]
    visit.switch_model(simplified=True)
    assert asked(visit) == []


def test_stop_is_silence_until_something_is_asked_for(visit: Visit) -> None:
    visit.play()
    assert asked(visit, "space") == ["silence"]
    assert not visit.playing
    assert asked(visit, "space") == [("canvas", 4)]
    assert asked(visit, "space", "3") == ["silence", ("MDF", 3)]
    assert visit.playing


def test_what_the_rig_has_halted_does_not_play_until_it_is_asked_for(visit: Visit) -> None:
    visit.play()
    visit.take_faults()
    assert visit.playing
    visit.rig.halted = True
    visit.take_faults()
    assert not visit.playing
    visit.rig.halted = False
    visit.take_faults()
    assert not visit.playing
    assert asked(visit, "space") == [("canvas", 4)]


def test_masking_noise_does_not_touch_the_texture(visit: Visit) -> None:
    assert asked(visit, "m", "m") == [True, False]
