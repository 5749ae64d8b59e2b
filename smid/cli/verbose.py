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
        LOGGER.info(
            "intervals: %s of order %d, complicating: %s; %d moments, largest block %d; %d solves in %d rounds, %.2f s",
            how.method,
            how.order,
            ", ".join(how.complicating) or "none",
            how.n_moments,
            how.largest_block,
            how.solves,
            how.rounds,
            how.seconds,
        )
        for interval in how.intervals:
            words = " and ".join(word or "not solved" for word in interval.status)
            ends = f"[{interval.lower:.9g}, {interval.upper:.9g}]"
            LOGGER.info("%s in %s, gap %.2g; the solver said %s", interval.name, ends, interval.gap, words)
    LOGGER.info("intervals: they stopped: %s", estimate.reason.value)


def log_error_bound(bound: ErrorBound) -> None:
    """Log how the least noise bound was enclosed."""
    LOGGER.info(
        "least noise bound of %s in [%.9g, %.9g] after %.2f s; it stopped: %s",
        bound.channel,
        bound.lower,
        bound.upper,
        bound.seconds,
        bound.reason.value,
    )


def log_diagnosis(diagnosis: Diagnosis) -> None:
    """Log the effects that were not tested, and those that were withdrawn."""
    for name, why in diagnosis.skipped.items():
        LOGGER.info("%s was not tested: %s", name, why)
    if diagnosis.dropped:
        LOGGER.info("withdrawn: %s", ", ".join(diagnosis.dropped))
    why = "interrupted" if diagnosis.interrupted else f"verdict {diagnosis.verdict.value}"
    LOGGER.info("diagnosis: %d causes in %.2f s; it stopped: %s", len(diagnosis.causes), diagnosis.seconds, why)
