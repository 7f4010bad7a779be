"""tactileq study validate: is the data folder as BIDS wants it?"""

from __future__ import annotations

import sys
from pathlib import Path
from typing import Annotated

import typer


def study_validate(
    data: Annotated[Path, typer.Argument(metavar="DATA", help="Folder of the study's answers.")],
) -> None:
    """Run the BIDS validator on a study's data; needs the extra publish, and no network.

    Errors are named, and the exit code is 1; warnings are counted.

    Example: tactileq study validate data
    """
    from tactileq.experiments.sessions.bids.validator import bids_issues, said_of
    from tactileq.experiments.sessions.kept.files import require_data_folder
    from tactileq.modeling.errors import counted

    require_data_folder(data)
    issues = bids_issues(data)
    errors = [issue for issue in issues if issue["severity"] == "error"]
    for issue in errors:
        print(f"error: {said_of(issue)}", file=sys.stderr)
    warnings = len(issues) - len(errors)
    print(f"BIDS: {counted(len(errors), 'error')}, {counted(warnings, 'warning')}")
    if errors:
        raise typer.Exit(1)
