"""tactileq study: the study file, its design, the page to preregister, its people."""

from __future__ import annotations

import typer

from tactileq.commands.study.check import study_check
from tactileq.commands.study.init import study_init
from tactileq.commands.study.plan import study_plan
from tactileq.commands.study.status import study_status
from tactileq.commands.study.validate import study_validate
from tactileq.commands.study.withdraw import study_dropout, study_withdraw

study = typer.Typer(
    no_args_is_help=True,
    rich_markup_mode=None,
    help="A study with people: its file, design, preregistration and progress.",
)
study.command("init")(study_init)
study.command("check")(study_check)
study.command("plan")(study_plan)
study.command("status")(study_status)
study.command("dropout")(study_dropout)
study.command("withdraw")(study_withdraw)
study.command("validate")(study_validate)
