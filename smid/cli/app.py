"""The command ``smid`` and its subcommands."""

from __future__ import annotations

from importlib.metadata import entry_points

import click

from smid.cli.console import Face

# Each line is the first sentence of the command's docstring, so that the help page needs no import of the command.
COMMANDS = {
    "app": (
        "smid.cli.serve:app",
        "Open a page in the browser that leads from a record to intervals, misfit and cause.",
    ),
    "compare": ("smid.cli.compare:compare", "Compare identified models by their free runs over one record."),
    "demo": (
        "smid.cli.demo:demo",
        "Identify a clutch actuator on simulated records, and find why the model fails on steps.",
    ),
    "diagnose": (
        "smid.cli.diagnose:diagnose",
        "Find what a model lacks on a record, and by how much the error falls if it is added.",
    ),
    "doctor": (
        "smid.cli.doctor:doctor",
        "Check this installation: versions, solvers, threads, optional packages, and a small problem.",
    ),
    "error-bound": (
        "smid.cli.error_bound:error_bound",
        "Compute the least noise bound with which a model explains a record.",
    ),
    "fit": ("smid.cli.fit:fit", "Fit a model to a record by least squares, or by the least largest error."),
    "identify": ("smid.cli.identify:identify", "Compute certified parameter intervals of a model from a record."),
    "phases": (
        "smid.cli.phases:phases",
        "Identify a model in three phases: error bound, certified intervals, validation on other records.",
    ),
    "projections": (
        "smid.cli.projections:projections",
        "Compute which values of two parameters go together: certified polygons for all pairs.",
    ),
    "residuals": (
        "smid.cli.residuals:residuals",
        "Test the residuals of an identified model: whiteness, independence of the input, spectrum.",
    ),
    "response": (
        "smid.cli.response:response",
        "Compute the step or frequency response of a model with certified bands.",
    ),
    "sensor": (
        "smid.cli.sensor:sensor",
        "Train a virtual sensor on records, run it, check it, and export it to C or ONNX.",
    ),
    "show": (
        "smid.cli.show:show",
        "Print what was understood of a record: channels, units, sampling time, gaps, ranges and faults.",
    ),
    "study": (
        "smid.cli.study:study",
        "Compute certified intervals for every combination of orders, methods and noise bounds.",
    ),
    "track": (
        "smid.cli.track:track",
        "Follow certified intervals of a linear model sample by sample, and prove changes of the plant.",
    ),
    "validate": ("smid.cli.validate:validate", "Simulate an identified model on other records."),
    "verify": (
        "smid.cli.verify:verify",
        "Check that a certificate holds, and that it is about this model and these data.",
    ),
}


def _installed() -> dict[str, tuple[str, str]]:
    """Return the commands of other packages and of the theses: entry points in the group ``smid.commands``."""
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
    """Compute certified parameter intervals of models from data, and find the cause of a model's errors.

    Exit codes: 0 done, 1 proven that no parameters explain the data, 2 bad input, 130 interrupted.
    """
    if context.invoked_subcommand is None:
        click.echo(context.get_help())
