"""Write what follows from declarations: tables of keys, columns and rooms in docs/, JSON Schemas,
and what a device's definition gives.

    python tools/docs_tables.py    # or make docs-tables

In a page, what stands between `<!-- keys: NAME -->` (or `table:`) and `<!-- end -->` is replaced. A
test finds all of it current (tests/test_docs_tables.py).
"""

from __future__ import annotations

import ast
import re
from functools import partial
from pathlib import Path

import tactileq
from tactileq.commands.study.schema import declared
from tactileq.experiments.sessions.bids import events, people, physio
from tactileq.experiments.sessions.kept import traces
from tactileq.experiments.tasks import threshold_table
from tactileq.modeling.files import answer_tables, stimulus_table
from tactileq.modeling.files.columns import markdown
from tactileq.modeling.files.describing import key_tables, schema_text
from tactileq.modeling.perception import thresholds
from tactileq.modeling.recordings import recording_set, trajectory
from tactileq.modeling.scenes import microcontrollers
from tactileq.rig.devices.hand import scripted
from tactileq.rig.machines.device.definition import DEVICE
from tactileq.rig.machines.device.models import UPLOAD_RANGES
from tactileq.rig.machines.recorder import store as recorder_store
from tactileq.rig.machines.recorder.definition import RECORDER
from tactileq.rig.recording.capture import pieces
from tactileq.rig.recording.importing import labels
from tactileq.rig.shared.wire import generating

ROOT = Path(__file__).parents[1]
TABLES = {
    "recordings": recording_set.KNOWN_COLUMNS,
    "labels": labels.LABEL_COLUMNS,
    "pieces": pieces.PIECE_COLUMNS,
    "recorder": recorder_store.RECORDER_COLUMNS,
    "manifest": stimulus_table.STIMULUS_COLUMNS,
    "trajectory": trajectory.TRAJECTORY_COLUMNS,
    "script": scripted.SCRIPT_COLUMNS,
    "threshold": thresholds.THRESHOLD_COLUMNS,
    "measured-threshold": threshold_table.THRESHOLD_TABLE_COLUMNS,
    "microcontrollers": microcontrollers.CONTROLLER_COLUMNS,
    "participants": (answer_tables.PARTICIPANT_ID, *answer_tables.PARTICIPANT_COLUMNS),
    "sessions": people.SESSION_COLUMNS,
    **{f"answers-{task}": table.columns for task, table in answer_tables.ANSWER_TABLES.items()},
    "events": events.EVENT_COLUMNS,
    "physio": physio.PHYSIO_COLUMNS,
    "hand": traces.HAND_COLUMNS + traces.WALL_COLUMNS,
    "presentations": traces.PRESENTATION_COLUMNS,
}
PAGES = (
    "docs/scene-file.md",
    "docs/recipe-file.md",
    "docs/rig-file.md",
    "docs/study-file.md",
    "docs/saved-files.md",
    "docs/data.md",
    "docs/device.md",
    "docs/device-registers.md",
    "docs/recorder.md",
    "docs/recorder-registers.md",
    "docs/where.md",
)
SCHEMAS = {
    "modeling/scenes/shipped/scene.schema.json": "scene",
    "docs/recipe.schema.json": "recipe",
    "rig/shared/setup/rig.schema.json": "rig",
    "rig/machines/recorder/recorder.schema.json": "recorder",
    "experiments/study/study.schema.json": "study",
}
DEVICE_FILES = {
    "rig/machines/device/registers.h": (generating.c_header, DEVICE),
    "rig/machines/device/registers.py": (generating.python_module, DEVICE),
    "docs/device/vectors.json": (generating.vectors, DEVICE),
    "rig/machines/recorder/registers.h": (generating.c_header, RECORDER),
    "rig/machines/recorder/registers.py": (
        partial(generating.python_module, prefix="Recorder"),
        RECORDER,
    ),
}
# What folders hold whose __init__.py does not say it: those without one, and the public face.
FOLDERS = {
    "modeling/perception/shipped": "Threshold tables that ship.",
    "modeling/scenes/shipped": "Scenes and micro-controllers that ship.",
    "stimuli/planted/spectral_statistics": "The statistics that surfaces are drawn from.",
    "rig/machines/board/boards": "What one writes for another board.",
    "experiments/console/texts": "The words of the pages, by language.",
    "tactileq": "The public face; the command line: options, printing, processes, what a run may "
    "replace.",
}
ROOMS = ("modeling", "stimuli", "rig", "experiments", "analysis", "benches", "tactileq")
_OF_A_DEVICE = {"registers": generating.register_table, "masks": generating.mask_tables}


def room_table() -> str:
    """Each folder of the rooms with its sentence: the first paragraph of its __init__.py."""
    said = dict(FOLDERS)
    for room in ROOMS:
        for path in (ROOT / room).rglob("__init__.py"):
            doc = ast.get_docstring(ast.parse(path.read_text(encoding="utf-8"))) or ""
            folder = path.parent.relative_to(ROOT).as_posix()
            said.setdefault(folder, " ".join(doc.partition("\n\n")[0].split()))
    order = sorted(said, key=lambda folder: (ROOMS.index(folder.split("/")[0]), folder))
    rows = (f"| `{folder}` | {said[folder]} |" for folder in order)
    return "\n".join(("| folder | holds |", "|---|---|", *rows))


def upload_table() -> str:
    """What the device refuses an upload for, and the ranges of its numbers."""
    rows = ["| value | ModelFault | range of its numbers | |", "|---|---|---|---|"]
    for name, (value, meaning) in DEVICE.masks["ModelFault"].members.items():
        of = UPLOAD_RANGES.get(name.lower())
        if value:
            note = of.note if of and of.note else meaning
            rows.append(f"| {value} | `{name}` | {of or ''} | {note} |")
    return "\n".join(rows)


_MADE = {
    "rooms": lambda name: room_table(),
    "keys": lambda name: key_tables(declared(name)),
    "table": lambda name: markdown(TABLES[name]).rstrip("\n"),
    "upload": lambda name: upload_table(),
    "device": lambda name: _OF_A_DEVICE[name](DEVICE),
    "recorder": lambda name: _OF_A_DEVICE[name](RECORDER),
}
_MARKED = re.compile(r"(<!-- (\w+): (\S+) -->\n)(.*?)(<!-- end -->)", re.DOTALL)


def page(text: str) -> str:
    """A page with its tables as they are declared now."""
    return _MARKED.sub(lambda m: f"{m[1]}\n{_MADE[m[2]](m[3])}\n\n{m[5]}", text)


def generated() -> dict[str, str]:
    """What every page and schema should hold, by its path."""
    pages = {path: page((ROOT / path).read_text(encoding="utf-8")) for path in PAGES}
    pages |= {path: schema_text(declared(name)) for path, name in SCHEMAS.items()}
    return pages | {path: made(of) for path, (made, of) in DEVICE_FILES.items()}


if __name__ == "__main__":
    if (found := Path(tactileq.__file__).resolve().parents[1]) != ROOT.resolve():
        raise SystemExit(f"error: expected tactileq of {ROOT}, got that of {found}; install it.")
    for path, text in generated().items():
        (ROOT / path).parent.mkdir(exist_ok=True)
        (ROOT / path).write_text(text, encoding="utf-8")
