"""What host and recorder say to each other: recorder.yml."""

from __future__ import annotations

from pathlib import Path

from tactileq.rig.shared.wire.definition import Definition

RECORDER = Definition.load(Path(__file__).with_name("recorder.yml"))
