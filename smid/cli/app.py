"""The command ``smid`` and its subcommands."""

from __future__ import annotations

import click

from smid.cli.clutch import clutch
from smid.cli.demo import demo
from smid.cli.diagnose import diagnose
from smid.cli.doctor import doctor
from smid.cli.error_bound import error_bound
from smid.cli.face import Face
from smid.cli.hybrid import hybrid
from smid.cli.identify import identify
from smid.cli.study import study
from smid.cli.validate import validate
from smid.cli.verify import verify


@click.group(cls=Face, invoke_without_command=True, context_settings={"max_content_width": 110})
@click.version_option(package_name="smid")
@click.pass_context
def main(context: click.Context) -> None:
    """Set-membership identification: parameter intervals that are theorems.

    Exit codes: 0 done, 1 proven that no parameters explain the data, 2 bad input, 130 interrupted.
    """
    if context.invoked_subcommand is None:
        click.echo(context.get_help())


for command in (demo, identify, error_bound, validate, verify, diagnose, clutch, hybrid, study, doctor):
    main.add_command(command)
