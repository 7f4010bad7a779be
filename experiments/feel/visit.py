"""A visitor's choice, and the requests to the rig when it changes."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import partial

from tactileq.experiments.feel.rigs import FeltRig
from tactileq.experiments.feel.textures import Texture


class Visit:
    """Textures to switch between on a rig.

    Parameters
    ----------
    textures : sequence of Texture
        One at least.
    rig : FeltRig
        Open.
    """

    def __init__(self, textures: Sequence[Texture], rig: FeltRig) -> None:
        self.textures = tuple(textures)
        self.rig = rig
        self.chosen = 0
        self.simplified = False
        self.playing = False
        self.masked = False
        self._keys: dict[str, Callable[[], None]] = {
            **{str(number): partial(self.choose, number - 1) for number in range(1, 10)},
            **dict.fromkeys(("right", "down"), partial(self.step, 1)),
            **dict.fromkeys(("left", "up"), partial(self.step, -1)),
            "f": lambda: self.switch_model(simplified=not self.simplified),
            "space": self.stop_or_play,
            "m": self.switch_masking,
        }

    @property
    def texture(self) -> Texture:
        """The chosen one."""
        return self.textures[self.chosen]

    def choose(self, index: int) -> None:
        """Feel the texture of this index; without effect where there is none."""
        if 0 <= index < len(self.textures):
            self.chosen = index
            self.play()

    def step(self, by: int) -> None:
        """Feel the next texture (1) or the one before (−1), round and round."""
        self.choose((self.chosen + by) % len(self.textures))

    def switch_model(self, *, simplified: bool) -> None:
        """Feel the simplified or the full model; the full one where there is no other."""
        wanted = simplified and self.texture.simplified is not None
        if wanted != self.simplified or not self.playing:
            self.simplified = wanted
            self.play()

    def play(self) -> None:
        """Let the hand feel what is chosen."""
        self.rig.present_model(self.texture.model(simplified=self.simplified))
        self.playing = True

    def stop(self) -> None:
        """Silence under the hand."""
        self.playing = False
        self.rig.silence()

    def stop_or_play(self) -> None:
        """Stop, or continue after a stop, which also arms a force device that has let go."""
        if self.playing:
            self.stop()
        else:
            self.rig.arm()
            self.play()

    def switch_masking(self) -> None:
        """Masking noise on or off."""
        self.masked = not self.masked
        self.rig.mask(self.masked)

    def take_faults(self) -> tuple[str, ...]:
        """What went wrong at the rig since the last call; what it has halted does not play."""
        faults = self.rig.take_faults()
        self.playing = self.playing and not self.rig.halted
        return faults

    def press(self, key: str) -> None:
        """Act on a key by PsychoPy's name for it; other keys have no effect."""
        self._keys.get(key, lambda: None)()
