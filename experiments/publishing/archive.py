"""What an archive is known by: by its provenance, and where its parts lie."""

from __future__ import annotations

import json
from pathlib import Path

COMMAND = "publish"
DATA, REPORT = "data", "report"
SETS_OF_MODELS, STIMULI, PSYCH_DS = "models", "stimuli", "psych-ds"
# What the report was made with beside the data.
RECORDINGS, REPORTED = "recordings", "reported_models"


def is_archive(folder: Path) -> bool:
    """Whether a folder was written by `tactileq publish`."""
    from tactileq.modeling.files.provenance import PROVENANCE_NAME

    try:
        note = json.loads((folder / PROVENANCE_NAME).read_bytes())
    except (OSError, ValueError):
        return False
    return isinstance(note, dict) and note.get("command") == f"tactileq {COMMAND}"
