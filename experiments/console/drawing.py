"""Colours, texts and shapes on a PsychoPy window.

Positions and sizes are in PsychoPy's unit `height`: (0, 0) is the middle of the window, 1 its
height. Everything fits a window of at least 4:3.
"""

from __future__ import annotations

import unicodedata
from importlib.util import find_spec
from pathlib import Path
from typing import Any

Point = tuple[float, float]
Box = tuple[float, float, float, float]  # x and y of the middle, width, height

# Okabe and Ito's colours, told apart by colour-blind people too. Their vermilion is darkened, so
# that what is written in it, or on it, has the contrast that reading needs (WCAG 2.2, 1.4.3).
BLUE = "#0072B2"
CONSOLE_ORANGE = "#B54F00"
INK = "#1F2328"
CONSOLE_GREY = "#5B6470"
PALE = "#C9CFD6"
CARD = "#FFFFFF"
PAPER = "#F4F5F7"

TITLE_HEIGHT = 0.046
TEXT_HEIGHT = 0.029
SMALL_HEIGHT = 0.024
LINE_SPACING = 1.45  # of lines of Japanese, in heights
HALF_RISE = 0.35  # from the baseline to the middle of a Japanese letter, in heights
SMALLEST_SHARE = 0.5  # of its height to which a label shrinks

# Where no line of Japanese begins, and where none ends.
NOT_FIRST = frozenset(
    "、。，．・：；？！）」』】〉》〕ー々…％%,.:;?!)]}ぁぃぅぇぉっゃゅょァィゥェォッャュョ"
)
NOT_LAST = frozenset("（「『【〈《〔([{")
NARROW_EM = 0.62  # how wide a Latin letter is, about; Japanese ones are 1


def text(
    window: Any,
    content: str,
    *,
    at: Point,
    height: float = TEXT_HEIGHT,
    color: str = INK,
    bold: bool = False,
    wrap: float = 1.15,
    anchor: str = "center",
) -> Any:
    """A PsychoPy text in type that comes with packages, the same on every machine.

    Latin text is set in PsychoPy's Noto Sans, text with a Japanese letter in IPAexGothic, which
    has no bold, and of which lines are broken here: PsychoPy breaks them at spaces only. Place and
    height are rounded to whole pixels: between two of them thin strokes, such as that of ー, fade.
    """
    from psychopy import visual

    pixels = window.winHandle.get_size()[1]
    at = (round(at[0] * pixels) / pixels, round(at[1] * pixels) / pixels)
    height = round(height * pixels) / pixels
    japanese = any(_is_wide(letter) for letter in content)
    drawn = visual.TextStim(
        window,
        text=wrapped(content, wrap / height) if japanese else content,
        pos=at,
        height=height,
        color=color,
        bold=bold and not japanese,
        wrapWidth=1.1 * wrap if japanese else wrap,
        anchorHoriz=anchor,
        alignText=anchor,
        font="IPAexGothic" if japanese else "Noto Sans",
        fontFiles=_japanese_fonts() if japanese else _latin_fonts(),
        units="height",
        autoLog=False,
    )
    if japanese and "\n" in drawn.text:
        # Lines of IPAexGothic would touch each other; PsychoPy has no setting for their distance,
        # which pyglet also leaves above the first line: raised by that, the text is in the middle.
        spacing = round(LINE_SPACING * height * pixels)
        drawn._pygletTextObj.set_style("line_spacing", spacing)
        drawn.pos = (at[0], at[1] + round(spacing / 2 - HALF_RISE * height * pixels) / pixels)
    return drawn


def fitted(window: Any, content: str, *, box: Point, height: float, **options: Any) -> Any:
    """A text as large as fits a box of this width and height, `height` at most."""
    smallest = SMALLEST_SHARE * height
    drawn = text(window, content, height=height, wrap=box[0], **options)
    while height > smallest and not _fits(window, drawn, box):
        height = max(0.9 * height, smallest)
        drawn = text(window, content, height=height, wrap=box[0], **options)
    return drawn


def _fits(window: Any, drawn: Any, box: Point) -> bool:
    pixels = window.winHandle.get_size()[1]
    across, upright = drawn.boundingBox
    return bool(across <= box[0] * pixels and upright <= box[1] * pixels)


def _latin_fonts() -> list[str]:
    import psychopy

    fonts = Path(psychopy.__file__).parent / "assets" / "fonts"
    return [str(fonts / f"NotoSans-{weight}.ttf") for weight in ("Regular", "Bold")]


def _japanese_fonts() -> list[str]:
    # Importing the package would import matplotlib: only its place is asked for.
    found = find_spec("matplotlib_fontja")
    assert found is not None
    assert found.origin is not None
    return [str(Path(found.origin).parent / "fonts" / "ipaexg.ttf")]


# --- Lines of Japanese ----------------------------------------------------------------------


def wrapped(content: str, width_em: float) -> str:
    """Break lines of Japanese into lines of about equal length.

    A line ends before a phrase where there is one, as Japanese is read (a phrase begins where
    something else follows hiragana or a comma), and never against the rules for punctuation.

    Parameters
    ----------
    content : str
        Its own line ends stay.
    width_em : float
        How many Japanese letters fit into a line.

    Returns
    -------
    str
    """
    return "\n".join(_balanced(line, width_em) for line in content.split("\n"))


def _balanced(line: str, width_em: float) -> str:
    lines = _filled(line, width_em)
    narrower = width_em
    while len(lines) > 1 and (narrower := narrower - 0.5) > 1:
        tried = _filled(line, narrower)
        if len(tried) > len(lines) or any(_width_em(part) > narrower for part in tried):
            break
        lines = tried
    return "\n".join(lines)


def _filled(line: str, width_em: float) -> list[str]:
    lines = [""]
    for phrase in _split(line, _begins_phrase):
        pieces = [phrase] if _width_em(phrase) <= width_em else _split(phrase, _may_break)
        for piece in pieces:
            if lines[-1] and _width_em((lines[-1] + piece).rstrip()) > width_em:
                lines[-1] = lines[-1].rstrip()
                lines.append(piece.lstrip())
            else:
                lines[-1] += piece
    return lines


def _split(line: str, begins: Any) -> list[str]:
    # Spaces at a line's end are cut off: what stands before them must not be an opening bracket.
    cuts = [
        i
        for i in range(1, len(line))
        if begins(line[i - 1], line[i]) and line[:i].rstrip()[-1:] not in NOT_LAST
    ]
    return [line[a:b] for a, b in zip([0, *cuts], [*cuts, len(line)], strict=True)]


def _may_break(before: str, after: str) -> bool:
    if after in NOT_FIRST or before in NOT_LAST or after == " ":
        return False
    return before == " " or _is_wide(before) or _is_wide(after)


def _begins_phrase(before: str, after: str) -> bool:
    ends = _is_hiragana(before) or before in "、。，．！？」』） "
    return ends and not _is_hiragana(after) and _may_break(before, after)


def _is_hiragana(letter: str) -> bool:
    return "\u3041" <= letter <= "\u309f"


def _is_wide(letter: str) -> bool:
    return unicodedata.east_asian_width(letter) in "WF"


def _width_em(line: str) -> float:
    return sum(1.0 if _is_wide(letter) else NARROW_EM for letter in line)


# --- Shapes ---------------------------------------------------------------------------------


def card(window: Any, *, box: Box, radius: float = 0.02, color: str = CARD) -> Any:
    """A card with round corners, white by default, on which other things stand."""
    from psychopy import visual

    return visual.ShapeStim(
        window,
        vertices=rounded(box[2:], radius),
        pos=box[:2],
        fillColor=color,
        lineColor=PALE if color == CARD else color,
        lineWidth=1,
        units="height",
        autoLog=False,
    )


def rounded(size: Point, radius: float) -> list[Point]:
    """Vertices of a rectangle of this width and height with round corners, about (0, 0)."""
    import numpy as np

    corners = ((1, 1, 0), (-1, 1, 90), (-1, -1, 180), (1, -1, 270))
    return [
        (
            sx * (size[0] / 2 - radius) + radius * float(np.cos(np.radians(start + turn))),
            sy * (size[1] / 2 - radius) + radius * float(np.sin(np.radians(start + turn))),
        )
        for sx, sy, start in corners
        for turn in range(0, 91, 10)
    ]
