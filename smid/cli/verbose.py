"""``--verbose``: log to standard error what is solved and why it stopped."""

from __future__ import annotations

import logging

import click

from smid.cli.console import LOGGER
from smid.diagnosis import Diagnosis
from smid.identification.error_bound import ErrorBound
from smid.identification.estimate import Estimate


def _listen(context: click.Context, _parameter: click.Parameter, asked: bool) -> None:
    """Write the log to standard error until the command ends."""
    if not asked:
        return
    handler = logging.StreamHandler()
    handler.setFormatter(logging.Formatter("%(asctime)s %(message)s", "%H:%M:%S"))
    before = LOGGER.level
    LOGGER.addHandler(handler)
    LOGGER.setLevel(logging.INFO)

    def remove() -> None:
        LOGGER.removeHandler(handler)
        LOGGER.setLevel(before)

    context.call_on_close(remove)


verbose_option = click.option(
    "--verbose",
    is_flag=True,
    is_eager=True,
    expose_value=False,
    callback=_listen,
    help="Log to standard error what is solved and why it stopped.",
)


def log_estimate(estimate: Estimate) -> None:
    """Log how the intervals were computed."""
    how = estimate.enclosure
    if how is not None:
        lifted = ", ".join(how.complicating) or "none"
        size = f"{how.n_moments} moments, largest block {how.largest_block}"
        work = f"{how.solves} solves in {how.rounds} rounds, {how.seconds:.2f} s"
        LOGGER.info(f"intervals: {how.method} of order {how.order}, complicating: {lifted}; {size}; {work}")
        for interval in how.intervals:
            words = " and ".join(word or "not solved" for word in interval.status)
            ends = f"[{interval.lower:.9g}, {interval.upper:.9g}]"
            LOGGER.info(f"{interval.name} in {ends}, gap {interval.gap:.2g}; the solver said {words}")
    LOGGER.info(f"intervals: they stopped: {estimate.reason.value}")


def log_error_bound(bound: ErrorBound) -> None:
    """Log how the least noise bound was enclosed."""
    ends = f"[{bound.lower:.9g}, {bound.upper:.9g}]"
    stopped = f"after {bound.seconds:.2f} s; it stopped: {bound.reason.value}"
    LOGGER.info(f"least noise bound of {bound.channel} in {ends} {stopped}")


def log_diagnosis(diagnosis: Diagnosis) -> None:
    """Log the effects that were not tested, and those that were withdrawn."""
    for name, why in diagnosis.skipped.items():
        LOGGER.info("%s was not tested: %s", name, why)
    if diagnosis.dropped:
        LOGGER.info("withdrawn: %s", ", ".join(diagnosis.dropped))
    why = "interrupted" if diagnosis.interrupted else f"verdict {diagnosis.verdict.value}"
    LOGGER.info("diagnosis: %d causes in %.2f s; it stopped: %s", len(diagnosis.causes), diagnosis.seconds, why)
