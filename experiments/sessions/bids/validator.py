"""The BIDS validator, which runs without the network."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from collections.abc import Mapping
from importlib.util import find_spec
from pathlib import Path
from typing import Any

LONGEST_S = 600


def bids_issues(data: Path) -> list[Mapping[str, Any]]:
    """What the validator says about a data set, by its own schema.

    Returns
    -------
    list of mapping
        With `severity` ("error", "warning"), `code`, `location` and others.

    Raises
    ------
    InputError
        If the validator is not installed, or does not end as it should.
    """
    from tactileq.modeling import InputError
    from tactileq.modeling.extras import MissingExtra, install_advice

    if find_spec("bids_validator_deno") is None:
        raise MissingExtra(
            f"expected the package bids_validator_deno, got none; {install_advice('publish')}."
        )
    program = Path(sys.executable).with_name("bids-validator-deno")
    # The program that it runs in lies beside it.
    path = f"{program.parent}{os.pathsep}{os.environ.get('PATH', '')}"
    ended = subprocess.run(
        [str(program), "--format", "json", "--max-rows", "-1", str(data)],
        capture_output=True,
        text=True,
        check=False,
        timeout=LONGEST_S,
        env={**os.environ, "PATH": path, "DENO_NO_UPDATE_CHECK": "1"},
    )
    try:
        issues: list[Mapping[str, Any]] = json.loads(ended.stdout)["issues"]["issues"]
    except (ValueError, KeyError, TypeError):
        told = (ended.stderr.strip().splitlines() or ["nothing"])[-1]
        raise InputError(
            f"expected a verdict of the BIDS validator on {data}, got {told}; run "
            f"{program.name} {data} to see more."
        ) from None
    return issues


def said_of(issue: Mapping[str, Any]) -> str:
    """One line on an issue."""
    parts = [issue.get(name) for name in ("location", "code", "subCode", "issueMessage")]
    return ": ".join(str(part) for part in parts if part)
