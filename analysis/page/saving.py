"""Figures become files: as PNG and SVG, in fonts that have the characters of their names."""

from __future__ import annotations

import io
import warnings
from collections.abc import Callable, Iterable
from contextlib import suppress
from functools import cache
from pathlib import Path

from matplotlib import rc_context
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.backends.backend_svg import FigureCanvasSVG
from matplotlib.figure import Figure
from matplotlib.font_manager import FontProperties, findfont, findSystemFonts, fontManager
from matplotlib.ft2font import FT2Font
from matplotlib.text import Text

DOTS_PER_INCH = 110  # of pictures that commands write
DEFAULT_FAMILY = "DejaVu Sans"  # comes with Matplotlib
REGULAR_WEIGHTS = (400, "normal", "regular", "book")

Drawing = Callable[[io.BytesIO], None]


def png_of(figure: Figure, *, dpi: float) -> tuple[bytes, str]:
    """The figure as PNG, in the fonts that its names ask for, and what none of them can draw.

    Matplotlib's own font has no Chinese, Japanese or Korean characters: those come from whatever
    font of this machine has them.

    Returns
    -------
    (bytes, str)
        The picture, and the characters that no font here has, in order; often none.
    """

    def draw(buffer: io.BytesIO) -> None:
        figure.set_dpi(dpi)
        # Laid out and drawn in one go; `savefig` goes through everything twice.
        FigureCanvasAgg(figure).print_png(buffer)  # type: ignore[no-untyped-call]

    drawn = _in_its_fonts(figure, draw)
    figure.set_layout_engine("none")  # its parts stay where they are: in an SVG of it, too
    return drawn


def svg_of(figure: Figure) -> tuple[bytes, str]:
    """The figure as SVG, text as outlines; the same bytes in every run.

    Returns
    -------
    (bytes, str)
        As `png_of`.
    """

    def draw(buffer: io.BytesIO) -> None:
        figure.set_dpi(72)
        # Text as outlines: it looks the same wherever the picture ends up, and no machine needs a
        # font with the characters of a name; it can be searched in the page and in the tables. The
        # salt gives what is drawn once and used again the same names in every run.
        with rc_context({"svg.fonttype": "path", "svg.hashsalt": "figure"}):
            canvas = FigureCanvasSVG(figure)
            canvas.print_svg(buffer, metadata={"Date": None})  # type: ignore[no-untyped-call]

    return _in_its_fonts(figure, draw)


def save_figure(figure: Figure, path: str | Path, *, dpi: float) -> None:
    """Write the figure as a PNG file; a warning names what no font of this machine can draw."""
    picture, lacking = png_of(figure, dpi=dpi)
    Path(path).write_bytes(picture)
    warn_of_missing_fonts(lacking)


def missing_fonts(lacking: str) -> str:
    """One sentence on the characters that are drawn as boxes; empty where there are none."""
    if not lacking:
        return ""
    return (
        f"expected fonts for all names in the pictures, found none on this machine for "
        f"{' '.join(lacking)}, drawn as boxes; install one, such as fonts-noto-cjk."
    )


def warn_of_missing_fonts(lacking: str) -> None:
    """Warn of these characters in one sentence, if there are any."""
    if lacking:
        warnings.warn(missing_fonts(lacking), stacklevel=3)


def _in_its_fonts(figure: Figure, draw: Drawing) -> tuple[bytes, str]:
    """What is drawn, once more in other fonts if names ask for them; and what no font has."""
    picture = _drawn(draw, families=(DEFAULT_FAMILY,))
    # Tick labels have their text only once they are drawn.
    texts = [text for text in figure.findobj(Text) if isinstance(text, Text)]
    foreign = _without_default({character for text in texts for character in text.get_text()})
    if not foreign:
        return picture, ""
    families, lacking = _families_for(foreign)
    if len(families) > 1:
        for text in texts:
            text.set_fontfamily(families)
        picture = _drawn(draw, families=families)
    return picture, lacking


def _drawn(draw: Drawing, *, families: tuple[str, ...]) -> bytes:
    buffer = io.BytesIO()
    with rc_context({"font.family": list(families)}), warnings.catch_warnings():
        # Said once for all characters by `missing_fonts`, and by Matplotlib for each.
        warnings.filterwarnings("ignore", message=r"Glyph .* missing from font")
        draw(buffer)
    return buffer.getvalue()


def _without_default(characters: Iterable[str]) -> str:
    """Those that Matplotlib's own font lacks, in order."""
    covered = _covered(findfont(FontProperties(family=DEFAULT_FAMILY)), 0, characters=characters)
    return "".join(sorted(c for c in set(characters) - set(covered) if c.isprintable()))


@cache
def _families_for(foreign: str) -> tuple[tuple[str, ...], str]:
    """Families of fonts, each with the most of what those before it lack; and what is left."""
    families, lacking = [DEFAULT_FAMILY], foreign
    while lacking:
        covered = {
            name: _covered(path, index, characters=lacking) for name, path, index in _faces()
        }
        best = max(covered, key=lambda name: len(covered[name]))
        if not covered[best]:
            break
        families.append(best)
        lacking = "".join(c for c in lacking if c not in covered[best])
    return tuple(families), lacking


@cache
def _faces() -> tuple[tuple[str, str, int], ...]:
    """Name, file and index of every upright font of this machine, in the order of their names."""
    # Matplotlib remembers the fonts of its first run; one installed since is not among them.
    for path in sorted(set(findSystemFonts()) - {entry.fname for entry in fontManager.ttflist}):
        with suppress(RuntimeError, OSError):  # a damaged font is none
            fontManager.addfont(path)
    return tuple(
        sorted(
            (entry.name, entry.fname, entry.index)
            for entry in fontManager.ttflist
            if entry.style == "normal"
            and entry.weight in REGULAR_WEIGHTS
            and "lastresort" not in entry.name.replace(" ", "").lower()  # boxes for everything
        )
    )


def _covered(path: str, index: int, *, characters: Iterable[str]) -> str:
    """Those of the characters that a font has; a font that has gone has none."""
    try:
        font = FT2Font(path, face_index=index)
    except (RuntimeError, OSError):
        return ""
    return "".join(c for c in characters if font.get_char_index(ord(c)))


def picture_bytes(figure: Figure) -> bytes:
    """A figure as a PNG file; a warning names what no font of this machine can draw."""
    picture, lacking = png_of(figure, dpi=DOTS_PER_INCH)
    warn_of_missing_fonts(lacking)
    return picture
