"""``smid verify``: check a proof, and that it is about this model and these data."""

from __future__ import annotations

import click

from smid.cli.console import EMPTY
from smid.cli.loading import load_data
from smid.cli.options import FILE, json_option
from smid.cli.outputs import Outputs
from smid.display.versions import versions
from smid.models import load_model
from smid.verification import NotProvenError
from smid.verification import verify as verify_proof
from smid.verification.verify import read_origin

VERIFY = "smid.verify/1"


@click.command()
@click.argument("proof", type=FILE)
@click.argument("data", type=FILE)
@click.option("--model", type=FILE, metavar="TOML", help="Model class and its fields; else as the proof states it.")
@click.option("--noise-bound", type=float, metavar="D", help="In the output's unit; else as the proof states it.")
@click.option("--input", "input_", metavar="U", help="Column of the input; else as the proof states it.")
@click.option("--output", metavar="Y", help="Column of the output; else as the proof states it.")
@click.option("--sampling-time", type=float, metavar="S", help="Seconds; else from time stamps, or as in the proof.")
@click.option("--time", metavar="COL", help="Column of time stamps; else the one called time.")
@click.option("--start", type=int, metavar="K", help="First sample to use, counted from 0.")
@click.option("--stop", type=int, metavar="K", help="First sample not to use any more.")
@json_option
@click.pass_context
def verify(
    context: click.Context,
    proof: str,
    data: str,
    model: str | None,
    noise_bound: float | None,
    input_: str | None,
    output: str | None,
    sampling_time: float | None,
    time: str | None,
    start: int | None,
    stop: int | None,
    json_: str | None,
) -> None:
    """Check PROOF (written by smid identify --certificate) against the record DATA and a model.

    Exit codes: 0 the proof holds, 1 it does not hold, 2 it is about another model or other data.
    """
    outputs = Outputs(json_, None)
    stated = read_origin(proof)["data"]
    columns = (input_ or stated["inputs"][0], output or stated["outputs"][0])
    interval = sampling_time or (None if time else float.fromhex(stated["sampling_time"]))
    record = load_data(data, *columns, interval, time, start, stop)
    try:
        found = verify_proof(proof, record, None if model is None else load_model(model), noise_bound)
    except NotProvenError as error:
        click.echo(f"refused: {' '.join(str(error).split())}", err=True)
        context.exit(EMPTY)
    outputs.say(found)
    outputs.write({"schema": VERIFY, "verification": found.to_dict(), "versions": versions()})
