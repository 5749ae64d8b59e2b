"""The command ``smid`` and its subcommands."""

from __future__ import annotations

from importlib.metadata import entry_points

import click

from smid.cli.console import Face

COMMANDS = {
    "demo": ("smid.cli.demo:demo", "Identify a clutch actuator on simulated records, and diagnose where it fails."),
    "diagnose": ("smid.cli.diagnose:diagnose", "Name what a model lacks on a record, and the gain of adding it."),
    "doctor": ("smid.cli.doctor:doctor", "Check this installation: versions, solvers, optional packages."),
    "error-bound": ("smid.cli.error_bound:error_bound", "Least noise bound with which a model explains a record."),
    "identify": ("smid.cli.identify:identify", "Certified intervals of a model's parameters."),
    "study": ("smid.cli.study:study", "Certified intervals for every combination of orders, methods, noise bounds."),
    "validate": ("smid.cli.validate:validate", "Simulate an identified model on other records."),
    "verify": ("smid.cli.verify:verify", "Check a certificate, and that it is about this model and these data."),
}


def _installed() -> dict[str, tuple[str, str]]:
    """Return the commands of other packages, and of the theses: entry points in the group ``smid.commands``."""
    return {point.name: (point.value, "") for point in entry_points(group="smid.commands")}


@click.group(
    cls=Face,
    targets={**_installed(), **COMMANDS},
    invoke_without_command=True,
    context_settings={"max_content_width": 110},
)
@click.version_option(package_name="smid")
@click.pass_context
def main(context: click.Context) -> None:
    """Set-membership identification: certified intervals of parameters, and the cause of a model's errors.

    Exit codes: 0 done, 1 proven that no parameters explain the data, 2 bad input, 130 interrupted.
    """
    if context.invoked_subcommand is None:
        click.echo(context.get_help())
