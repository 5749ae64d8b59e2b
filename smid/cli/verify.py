"""``smid verify``: check a proof, and that it is about this model and these data."""

from __future__ import annotations

from dataclasses import dataclass

import click

from smid.cli.console import EMPTY, Command
from smid.cli.loading import load_data
from smid.cli.options import FILE, INPUT, OUTPUT, Columns, Reading, argument, group, option, takes
from smid.cli.outputs import Outputs, writes
from smid.data import Dataset
from smid.display.versions import versions
from smid.models import load_model
from smid.reports.documents import VERIFY
from smid.verification import NotProvenError
from smid.verification import verify as verify_proof
from smid.verification.verify import read_origin


@dataclass(frozen=True)
class Claim:
    """A proof, and what the user knows of its model and data; the proof states the rest."""

    proof: str = argument(type=FILE)
    data: str = argument(type=FILE)
    model: str | None = option(
        type=FILE, metavar="TOML", help="File with the model class and its settings. [default: the model of the proof]"
    )
    noise_bound: float | None = option(
        type=float, metavar="D", help="Noise bound in the output's unit. [default: that of the proof]"
    )
    input: tuple[str, ...] = option(**INPUT)
    output: tuple[str, ...] = option(**OUTPUT)
    sampling_time: float | None = option(
        type=float, metavar="S", help="Sampling time in seconds. [default: as in the proof, or from --time]"
    )
    time: str | None = option(
        metavar="COL", help="Column of time stamps. [default: the column named time, or the only one of dates]"
    )
    reading: Reading = group(Reading)
    start: int | None = option(type=int, metavar="K", help="First sample to use, counted from 0.")
    stop: int | None = option(type=int, metavar="K", help="First sample after the last one to use.")

    def load(self) -> Dataset:
        """Return the samples; what the user did not name is read as the proof states it."""
        stated = read_origin(self.proof)["data"]
        interval = self.sampling_time or (None if self.time else float.fromhex(stated["sampling_time"]))
        columns = Columns(
            self.input or stated["inputs"], self.output or stated["outputs"], interval, self.time, self.reading
        )
        return load_data(self.data, columns, start=self.start, stop=self.stop)


@click.command(cls=Command)
@takes(claim=Claim)
@writes("json")
@click.pass_context
def verify(context: click.Context, claim: Claim, outputs: Outputs) -> None:
    """Check that a certificate holds, and that it is about this model and these data.

    PROOF is a file that smid identify --certificate wrote; DATA is the record (a CSV file).

    Exit codes: 0 the proof holds, 1 it does not hold, 2 it is about another model or other data.
    """
    data = claim.load()
    try:
        model = None if claim.model is None else load_model(claim.model)
        found = verify_proof(claim.proof, data, model, claim.noise_bound)
    except NotProvenError as error:
        click.echo(f"refused: {' '.join(str(error).split())}", err=True)
        context.exit(EMPTY)
    outputs.say(found)
    outputs.write({"schema": VERIFY, "verification": found.to_dict(), "versions": versions()})
