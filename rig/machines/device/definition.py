"""The device's definition (`device.yml`)."""

from __future__ import annotations

from pathlib import Path

from tactileq.rig.shared.wire.definition import Definition

DEVICE = Definition.load(Path(__file__).with_name("device.yml"))
