"""``--verbose``: what is solved and why it stopped, through the standard library's ``logging``, on standard error."""

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

    def deafen() -> None:
        LOGGER.removeHandler(handler)
        LOGGER.setLevel(before)

    context.call_on_close(deafen)


verbose_option = click.option(
    "--verbose",
    is_flag=True,
    is_eager=True,
    expose_value=False,
    callback=_listen,
    help="Log what is solved, and why it stopped.",
)


def log_estimate(estimate: Estimate) -> None:
    """Log how the intervals came about."""
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
    """Log how the enclosure of the least noise bound came about."""
    LOGGER.info(
        "least bound of %s in [%.9g, %.9g] after %.2f s; it stopped: %s",
        bound.channel,
        bound.lower,
        bound.upper,
        bound.seconds,
        bound.reason.value,
    )


def log_diagnosis(diagnosis: Diagnosis) -> None:
    """Log what was tried and left out."""
    for name, why in diagnosis.skipped.items():
        LOGGER.info("%s was not tried: %s", name, why)
    if diagnosis.dropped:
        LOGGER.info("dropped again: %s", ", ".join(diagnosis.dropped))
    why = "interrupted" if diagnosis.interrupted else f"verdict {diagnosis.verdict.value}"
    LOGGER.info("diagnosis: %d causes in %.2f s; it stopped: %s", len(diagnosis.causes), diagnosis.seconds, why)
