"""The window for visitors on a real screen, operated by a real mouse and keyboard."""

from __future__ import annotations

import json
import subprocess
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from PIL import Image

from tests.experiments.driven import Driven

DRIVER = Path(__file__).with_name("feel_visit.py")
BLUE = (0x00, 0x72, 0xB2)


class Visitor:
    """Hand and eyes of the person at the window."""

    def __init__(self, program: subprocess.Popen[str], environment: dict[str, str]) -> None:
        self.program = program
        self.environment = environment
        self.handles: dict[str, tuple[int, int]] = {}
        self.words: list[str] = []

    def hear(self) -> dict[str, Any]:
        line = self.program.stdout.readline()
        assert line, "the program ended without a word"
        news: dict[str, Any] = json.loads(line)
        if "frame" in news:
            self.handles, self.words = news["frame"], news["words"]
        return news

    def wait_for(self, what: str) -> Any:
        while what not in (news := self.hear()):
            pass
        return news[what]

    def look(self, path: Path) -> np.ndarray[Any, Any]:
        """A picture of the next frame; the words on it are in `words`."""
        self.program.stdin.write(f"{path}\n")
        self.program.stdin.flush()
        self.wait_for("frame")
        return np.asarray(Image.open(path).convert("RGB")).astype(int)

    def xdotool(self, *words: object) -> None:
        subprocess.run(["xdotool", *map(str, words)], env=self.environment, check=True, timeout=500)

    def click(self, handle: str) -> list[object]:
        """Click on a button; what the rig is asked for then."""
        self.xdotool("mousemove", *self.handles[handle], "click", 1)
        return self.wait_for("asked")

    def press(self, key: str) -> list[object]:
        """Press a key; what the rig is asked for then."""
        self.xdotool("key", key)
        return self.wait_for("asked")


@pytest.fixture(scope="module")
def windows(display: str) -> Iterator[Driven]:
    shown = Driven(DRIVER, display=display)
    yield shown
    shown.close()


@contextmanager
def visiting(windows: Driven, width: int, height: int) -> Iterator[Visitor]:
    """Somebody at a window; the block is left with its end."""
    with windows.window(f"{width} {height}") as program:
        visitor = Visitor(program, windows.environment)
        assert visitor.wait_for("asked") == ["canvas", 4]  # it plays at once
        visitor.wait_for("frame")
        x, y = visitor.handles["noise"]
        visitor.xdotool("mousemove", x, y + 40)  # keys go to the window under the pointer
        yield visitor


def pixels(picture: np.ndarray[Any, Any], colour: tuple[int, int, int]) -> int:
    """How many pixels of the left half, where the spectra are, are of this colour."""
    half = picture[:, : picture.shape[1] // 2]
    return int((np.abs(half - np.array(colour)).max(axis=-1) < 12).sum())


def test_keys_and_buttons_change_what_plays_and_what_is_drawn(
    tmp_path: Path, windows: Driven
) -> None:
    size = (1024, 768)
    with visiting(windows, *size) as visitor:
        full = visitor.look(tmp_path / "full.png")
        assert "canvas, full model" in visitor.words
        assert "simulated texture, simulated hand, force assumed" in visitor.words
        assert "limits touched: peak" in visitor.words

        assert visitor.press("f") == ["canvas", 1]
        fewer = visitor.look(tmp_path / "fewer.png")
        assert "canvas, simplified model" in visitor.words
        # The curve that plays is thicker, its layers stand on stems.
        assert pixels(fewer, BLUE) > 1.5 * pixels(full, BLUE)

        assert visitor.press("2") == ["leather", 4]
        leather = visitor.look(tmp_path / "leather.png")
        assert "leather, full model" in visitor.words
        assert "no simplified model" in visitor.words
        assert pixels(leather, BLUE) < 0.2 * pixels(fewer, BLUE)

        assert visitor.click("texture 1") == ["canvas", 1]
        assert visitor.click("full") == ["canvas", 4]
        assert visitor.click("stop") == ["silence"]
        visitor.look(tmp_path / "stopped.png")
        assert "canvas, full model: stopped" in visitor.words
        assert "the tablet is gone." in visitor.words  # until something is pressed
        assert visitor.press("space") == ["canvas", 4]
        visitor.look(tmp_path / "goes_on.png")
        assert "the tablet is gone." not in visitor.words
        assert visitor.click("noise") == ["mask", True]
        assert visitor.press("m") == ["mask", False]
        assert visitor.press("Right") == ["leather", 4]
        visitor.xdotool("key", "Escape")
        while "ended" not in (news := visitor.hear()):
            pass
        # The pointer's way, which may be the hand's, from the bottom left of the window.
        assert len(news["pointed"]) >= 4
        assert all(0 <= x < size[0] and 0 <= y < size[1] for x, y in news["pointed"])


def test_a_wide_window_is_filled(tmp_path: Path, windows: Driven) -> None:
    with visiting(windows, 1920, 1080) as visitor:
        picture = visitor.look(tmp_path / "wide.png")
        assert picture.shape == (1080, 1920, 3)
        white = (picture.min(axis=-1) > 250).mean(axis=0)  # the ground of its parts, by columns
        assert white[[60, 1860]].min() > 0.3
        assert "simulated texture, simulated hand, force assumed" in visitor.words
        # The window's own button for closing.
        visitor.program.stdin.write("close\n")
        visitor.program.stdin.flush()
        assert visitor.wait_for("ended")
