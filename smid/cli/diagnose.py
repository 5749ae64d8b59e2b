"""``smid diagnose``: what a model's simulation gets wrong on a record, why, and what to add."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import click

from relaxations.errors import UserError
from smid.cli.console import INTERRUPTED, Command, Progress
from smid.cli.loading import load_record, noisy_outputs, read_table, stated_bounds, unread_columns
from smid.cli.options import FILE, POSITIVE, NoiseBound, Record, option, read_known_bounds, seconds_option, takes
from smid.cli.outputs import Outputs, writes
from smid.cli.verbose import log_diagnosis, verbose_option
from smid.data import Dataset
from smid.diagnosis import EFFECTS, Diagnosis, certify_name, prove_name, prove_parameters
from smid.diagnosis import diagnose as diagnose_model
from smid.diagnosis.diagnosis import ENDED_EARLY
from smid.fitting.binding import bind_whole
from smid.identification.identify import EmptyFeasibleSetError
from smid.models import Model, load_model, save_model
from smid.models.parts import plain_name
from smid.reports import check_writable
from smid.reports import report as write_report
from smid.reports.documents import diagnose_document


def _list_effects(context: click.Context, _parameter: click.Parameter, asked: bool) -> None:
    """Print the table of effects and exit."""
    if not asked:
        return
    width = max(len(effect.name) for effect in EFFECTS)
    for effect in EFFECTS:
        click.echo(f"{effect.name.ljust(width)}  {effect.summary}")
    context.exit()


@dataclass(frozen=True)
class Search:
    """What a diagnosis tests, and how."""

    model: str | None = option(type=FILE, metavar="TOML", help="File with the model class and its settings.")
    simulated: str | None = option(
        metavar="COL", help="Column with the output of a simulator, to diagnose it instead of a model."
    )
    about: str | None = option(metavar="COL", help="Output to diagnose, of several. [default: the first of the model]")
    channels: tuple[str, ...] = option(
        "--channel", multiple=True, metavar="COL", help="Further column to consider; repeatable."
    )
    noise_bound: tuple[NoiseBound, ...] | None = option(
        callback=read_known_bounds,
        metavar="D|Y=D,...",
        help="Noise bound of the output in its unit; with several outputs one number for all, or one for each.",
    )
    effects: str | None = option(metavar="A,B,...", help="Effects to test. [default: all]")
    test: float = option(
        type=click.FloatRange(0.05, 0.9),
        default=0.2,
        show_default=True,
        help="Share of the record, at its end, that no fit and no choice uses: the gain is measured there.",
    )
    workers: int | None = option(
        type=click.IntRange(min=1), metavar="N", help="Number of processes. [default: one for each processor]"
    )
    save_model: str | None = option(
        type=FILE, metavar="TOML", help="Write the extended model as a model file, to use it again."
    )
    no_certify: bool = option(is_flag=True, help="Skip the proof that the model cannot explain the data.")
    prove: int | None = option(
        type=click.IntRange(min=2),
        metavar="N",
        help="Certify the intervals of the added parameters from the first N samples; needs --noise-bound.",
    )
    prove_name: float | None = option(
        type=POSITIVE,
        metavar="S",
        help="Prove in S seconds: the base model cannot fit the samples of its largest error, the extended model can, "
        "its rivals cannot; needs --noise-bound.",
    )
    certificates: str | None = option(
        type=click.Path(file_okay=False),
        metavar="FOLDER",
        help="Write a certificate of each model that --prove-name excludes, in at most S seconds more.",
    )

    @property
    def chosen(self) -> list[str] | None:
        """Return the names of the effects to test; None for all."""
        return None if self.effects is None else [name.strip() for name in self.effects.split(",") if name.strip()]

    def settings(self, unit: str) -> dict[str, str]:
        """Return the options for the end of the report."""
        return {
            "noise bound": "none" if self.noise_bound is None else _listed(self.noise_bound, unit),
            "effects": "all" if self.chosen is None else ", ".join(self.chosen),
            "test part": f"{self.test:g} of the record, at its end",
            **({} if self.simulated is None else {"simulation": self.simulated}),
            "command": "smid diagnose",
        }


@click.command(cls=Command)
@takes(record=Record, search=Search)
@click.option(
    "--list-effects",
    is_flag=True,
    is_eager=True,
    expose_value=False,
    callback=_list_effects,
    help="Print the effects and exit.",
)
@seconds_option
@writes("json", "report")
@verbose_option
@click.pass_context
def diagnose(context: click.Context, record: Record, search: Search, seconds: float, outputs: Outputs) -> None:
    """Find what a model lacks on a record, and by how much the error falls if it is added.

    DATA is the record (a CSV file).
    """
    if (search.model is None) == (search.simulated is None):
        raise click.UsageError("give --model TOML, or --simulated COL for a recorded simulation")
    for name, asked in (("--prove", search.prove), ("--prove-name", search.prove_name)):
        if asked is not None and search.noise_bound is None:
            raise click.UsageError(f"{name} needs a noise bound: give --noise-bound D")
        if asked is not None and search.simulated is not None:
            raise click.UsageError(f"{name} needs a model: of a simulator only the recorded output is known")
    if search.certificates is not None and search.prove_name is None:
        raise click.UsageError("--certificates needs a proof: give --prove-name S")
    if search.certificates is not None:
        Path(search.certificates).mkdir(parents=True, exist_ok=True)
        check_writable(Path(search.certificates, "base.json"))
    if search.save_model is not None:
        check_writable(search.save_model)
    further = search.channels if search.simulated is None else (*search.channels, search.simulated)
    given = None if search.model is None else load_model(search.model)
    table = read_table(Path(record.path), record.columns.reading)
    data = load_record(record, given, further, table)
    base = None if given is None else bind_whole(given, data)
    diagnosis = _diagnosis(base, data, search, seconds, outputs)
    log_diagnosis(diagnosis)
    outputs.say(diagnosis)
    unread = [] if diagnosis.causes else unread_columns(record, table, data)
    if unread:
        outputs.say(f"Columns that were not read: {', '.join(unread)}. Give one that may act by --channel NAME.")
    outputs.write(diagnose_document(diagnosis))
    outputs.write_report(lambda path: write_report(diagnosis, path, settings=search.settings(diagnosis.unit)))
    if search.save_model is not None:
        outputs.say(f"model: {save_model(diagnosis.model, search.save_model)}")
    if diagnosis.interrupted:
        if outputs.json == "-":
            click.echo(ENDED_EARLY, err=True)
        context.exit(INTERRUPTED)


def _listed(bounds: Sequence[NoiseBound], unit: str) -> str:
    return f"{bounds[0]} {unit}".rstrip() if len(bounds) == 1 else ", ".join(map(str, bounds))


def _bounds(base: Model | None, asked: Sequence[NoiseBound]) -> float | dict[str, float]:
    """Return the noise bounds by output; one number for a recorded simulation."""
    if base is None or not noisy_outputs(base):
        return asked[0].value
    return {c: bound.value for c, bound in stated_bounds("--noise-bound", noisy_outputs(base), asked).items()}


def _diagnosis(base: Model | None, data: Dataset, search: Search, seconds: float, outputs: Outputs) -> Diagnosis:
    """Return the diagnosis, with the proofs that the user asked for; without them it is written before they begin."""
    bound = None if search.noise_bound is None else _bounds(base, search.noise_bound)
    with Progress() as progress:
        diagnosis = diagnose_model(
            base,
            data,
            bound,
            search.chosen,
            search.test,
            output=None if search.about is None else plain_name(search.about),
            simulated=None if search.simulated is None else plain_name(search.simulated),
            certify=not search.no_certify,
            workers=search.workers,
            seconds=seconds,
            progress=progress,
        )
        if bound is None or diagnosis.interrupted:
            return diagnosis
        if (search.prove is not None or search.prove_name is not None) and outputs.json != "-":
            outputs.write(diagnose_document(diagnosis))
        # A proof that fails, for whatever reason, or that Ctrl-C ends, costs only the proof.
        if search.prove is not None and diagnosis.causes:
            try:
                diagnosis = prove_parameters(diagnosis, bound, search.prove)
            except (Exception, KeyboardInterrupt) as error:
                click.echo(f"warning: the intervals were not certified: {_reason(error)}", err=True)
        if search.prove_name is not None:
            try:
                diagnosis = prove_name(diagnosis, bound, search.prove_name, progress, workers=search.workers)
            except (Exception, KeyboardInterrupt) as error:
                click.echo(f"warning: the name was not proven: {_reason(error)}", err=True)
        if search.prove_name is not None and search.certificates is not None and diagnosis.name_proof is not None:
            try:
                diagnosis = certify_name(diagnosis, bound, search.certificates, search.prove_name, progress)
            except (Exception, KeyboardInterrupt) as error:
                click.echo(f"warning: certificates are missing: {_reason(error)}", err=True)
        return diagnosis


def _reason(error: BaseException) -> str:
    """Return why a proof failed, in one line; an error that is no user's mistake is named by its kind too."""
    if isinstance(error, KeyboardInterrupt):
        return "interrupted"
    told = " ".join(str(error).split())
    return told if isinstance(error, UserError | EmptyFeasibleSetError) else f"{type(error).__name__}: {told}"
