"""The generated tables of docs/, from what declares them: `make docs-tables`."""

from __future__ import annotations

import re
import sys
from collections.abc import Callable, Mapping
from functools import partial
from pathlib import Path

ROOT = Path(__file__).parents[1]
sys.path.insert(0, str(ROOT))

from experiments.sessions import bids_events, bids_people, bids_physio, traces  # noqa: E402
from experiments.tasks import threshold_table  # noqa: E402
from modeling.files import answer_tables, stimulus_table  # noqa: E402
from modeling.files.columns import markdown  # noqa: E402
from modeling.perception import thresholds  # noqa: E402
from modeling.recordings import recording_set, trajectory  # noqa: E402
from modeling.scenes import microcontrollers  # noqa: E402
from rig.capture import pieces  # noqa: E402
from rig.hand import scripted  # noqa: E402
from rig.importing import labels  # noqa: E402

_COLUMNS = {
    "recordings": recording_set.KNOWN_COLUMNS,
    "labels": labels.LABEL_COLUMNS,
    "pieces": pieces.COLUMNS,
    "manifest": stimulus_table.COLUMNS,
    "trajectory": trajectory.COLUMNS,
    "script": scripted.COLUMNS,
    "threshold": thresholds.COLUMNS,
    "measured-threshold": threshold_table.COLUMNS,
    "microcontrollers": microcontrollers.COLUMNS,
    "participants": (answer_tables.PARTICIPANT_ID, *answer_tables.PARTICIPANT_COLUMNS),
    "sessions": bids_people.SESSION_COLUMNS,
    **{f"answers-{task}": table.columns for task, table in answer_tables.ANSWER_TABLES.items()},
    "events": bids_events.COLUMNS,
    "physio": bids_physio.COLUMNS,
    "hand": traces.HAND_COLUMNS,
    "presentations": traces.PRESENTATION_COLUMNS,
}
# What stands in a page between `<!-- table: NAME -->` and `<!-- end -->`.
PAGES: dict[str, Mapping[str, Callable[[], str]]] = {
    "data.md": {name: partial(markdown, columns) for name, columns in _COLUMNS.items()},
}
_MARKED = re.compile(r"(<!-- table: (\S+) -->\n).*?(<!-- end -->)", re.DOTALL)


def current(page: str) -> str:
    """The text of a page with its tables as they are declared now."""
    text = (ROOT / "docs" / page).read_text(encoding="utf-8")
    return _MARKED.sub(lambda found: f"{found[1]}{PAGES[page][found[2]]()}\n{found[3]}", text)


if __name__ == "__main__":
    for name in PAGES:
        (ROOT / "docs" / name).write_text(current(name), encoding="utf-8")
