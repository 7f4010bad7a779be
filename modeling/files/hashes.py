"""SHA-256 of what is saved, by which files name what they rest on."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Mapping
from typing import Any


def sha256_of(text: str) -> str:
    """SHA-256 of a text (UTF-8), 64 hexadecimal digits."""
    return hashlib.sha256(text.encode("utf-8")).hexdigest()


def sha256_of_values(values: Mapping[str, Any]) -> str:
    """SHA-256 of plain values, whatever the order of their names."""
    return sha256_of(json.dumps(values, sort_keys=True, ensure_ascii=False))
