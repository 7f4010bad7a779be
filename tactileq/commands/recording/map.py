"""The map of tactileq record --audio: recorded conditions, what to stroke next, the input."""

from __future__ import annotations

from math import isnan, log10
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from rich.console import Group
    from rich.table import Table
    from rich.text import Text

    from tactileq.modeling.models.grid import Condition
    from tactileq.rig.recording.capture.coverage import Coverage
    from tactileq.rig.recording.capture.recorder import HandLately, InputLevel, StrokeRecorder

# Okabe–Ito blue and orange; characters in each cell repeat what its colour means.
FULL, PART, NEXT = "#56B4E9", "#E69F00", "bold reverse"
METER_DB, METER_WIDTH = 60.0, 30


def recording_map(recorder: StrokeRecorder) -> Group:
    """The state of a recording: grid, hand, input, and warnings."""
    from rich.console import Group
    from rich.text import Text

    coverage = recorder.coverage
    target, words = recorder.target(coverage)
    lines = [hand_line(recorder.hand, target, words), level_line(recorder.level)]
    warnings = [Text(f"warning: {warning}", style=PART) for warning in recorder.warnings()]
    done, of = int(coverage.full.sum()), len(coverage.grid.conditions)
    head = Text(
        f"{done} of {of} conditions recorded; seconds so far, of {coverage.wanted_s:g} s each:"
    )
    legend = Text("ok full, > next, * you are here", style="dim")
    table = grid_table(coverage, target, here=recorder.condition)
    return Group(head, table, legend, *lines, *warnings)


def grid_table(coverage: Coverage, target: Condition | None, *, here: Condition | None) -> Table:
    """Seconds of every cell: `ok` full, `>` next, `*` under the hand, `-` nothing yet.

    Cells that are not wanted are blank.
    """
    from rich.table import Table
    from rich.text import Text

    table, wanted = Table(), coverage.grid.wanted
    table.add_column("N \\ mm/s", justify="right")
    for speed in coverage.grid.speeds_mm_s:
        table.add_column(f"{speed:g}", justify="right", min_width=6)
    for column in reversed(range(coverage.grid.forces_n.size)):
        force = float(coverage.grid.forces_n[column])
        cells = []
        for row, speed in enumerate(coverage.grid.speeds_mm_s.tolist()):
            if not wanted[row, column]:
                cells.append(Text())
                continue
            text, style = _cell(
                float(coverage.seconds[row, column]),
                full=bool(coverage.full[row, column]),
                marks=(">" if (speed, force) == target else "")
                + ("*" if (speed, force) == here else ""),
            )
            cells.append(Text(text, style=style))
        table.add_row(f"{force:g}", *cells)
    return table


def _cell(seconds: float, *, full: bool, marks: str) -> tuple[str, str]:
    """Text and style of a cell."""
    if full:
        return f"{marks}ok", FULL
    text = f"{marks}{seconds:.2f}" if seconds > 0 else f"{marks}-"
    return text, NEXT if ">" in marks else PART if seconds > 0 else ""


def hand_line(hand: HandLately, target: Condition | None, words: list[str]) -> Text:
    """What the hand does, and what it should."""
    from rich.text import Text

    if target is None:
        return Text("all conditions are recorded", style=FULL)
    now = f"{hand.speed_mm_s:.0f} mm/s, {hand.force_n:.2f} N" if hand.touching else "off surface"
    say = ", ".join(words).upper() or ("good: continue" if hand.touching else "touch and stroke")
    return Text.assemble(
        f"hand: {now}; next: {target[0]:g} mm/s at {target[1]:g} N: ", (say, "bold")
    )


def level_line(level: InputLevel) -> Text:
    """The input: a bar of its level, peak, floor, and whether it clips."""
    from rich.text import Text

    floor = "not measured yet" if isnan(level.floor_g) else f"{level.floor_g:.2g} g"
    text = (
        f"input: [{_meter(level)}] {level.rms_g:.2g} g RMS, peak {level.peak_g:.2g} g, "
        f"at rest {floor}"
    )
    return Text.assemble(text, (" CLIPPING" if level.clipping else "", "bold reverse"))


def _meter(level: InputLevel) -> str:
    """A bar over the 60 dB below full scale: RMS `#`, peak `|`."""

    def place(value: float) -> int:
        db = 20 * log10(max(value, 1e-12) / level.full_scale_g)
        return min(max(round((1 + db / METER_DB) * METER_WIDTH), 0), METER_WIDTH)

    bar = "#" * place(level.rms_g)
    peak = max(place(level.peak_g), 1)
    bar = bar.ljust(METER_WIDTH)
    return bar[: peak - 1] + "|" + bar[peak:]
