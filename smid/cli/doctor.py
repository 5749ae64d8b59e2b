"""``smid doctor``: whether this installation works, its versions, and the optional packages."""

from __future__ import annotations

import os
import re
import time
from collections.abc import Iterator
from dataclasses import asdict, dataclass
from importlib.metadata import PackageNotFoundError, requires, version
from importlib.util import find_spec
from typing import Any

import click
import numpy as np

from relaxations.errors import ProblemError
from relaxations.search.enclosure import Proof, Reason
from relaxations.solvers.interface import available_solvers
from smid.cli.console import BAD_INPUT, Command
from smid.cli.documents import DOCTOR
from smid.cli.outputs import Outputs, writes
from smid.data import Dataset
from smid.identification.identify import identify
from smid.models import OutputError
from smid.processes import THREADS
from smid.reports import versions
from smid.reports.pdf import find_browser

EXTRAS = {
    "app": (("tornado",), "smid app, the page in the browser"),
    "control": (("control",), "Estimate.to_control"),
    "excel": (("openpyxl",), "Excel workbooks"),
    "parquet": (("pyarrow",), "Parquet files"),
    "xarray": (("xarray",), "records as labelled arrays"),
    "dask": (("dask", "distributed"), "studies on a cluster"),
    "onnx": (("onnx",), "export_onnx, virtual sensors as ONNX"),
    "scs": (("scs",), "the solver SCS"),
    "sdpa": (("sdpap",), "the solver SDPA, under the GPL"),
    "notebooks": (("jupytext", "nbconvert", "ipykernel"), "make notebooks"),
    "bench": (("pyscipopt", "padasip", "filterpy", "sklearn", "codac"), "other tools that make bench compares with"),
    "peers": (("sysidentpy", "jax_sysid"), "other tools that benchmarks.peers compares with"),
    "hybrid-peers": (("diffrax", "casadi", "pysindy"), "other tools that benchmarks.hybrid_peers compares with"),
    "docs": (("sphinx", "myst_nb", "numpydoc", "furo"), "make docs"),
}
"""Extra of pip -> (the modules it installs, what they are for)."""

TRUE_POLE = -0.5


@dataclass(frozen=True)
class Trouble:
    """A required part that does not work."""

    cause: str
    cure: str


@dataclass(frozen=True)
class SmallProblem:
    """The result of the small problem: the interval of its pole, None if there is none.

    ``certified``: both bounds are proven and attained by verified parameters, and the true pole lies between them.
    """

    lower: float | None
    upper: float | None
    reason: str
    certified: bool
    seconds: float


@click.command(cls=Command)
@writes("json")
@click.pass_context
def doctor(context: click.Context, outputs: Outputs) -> None:
    """Check this installation: versions, solvers, threads, optional packages, and a small problem."""
    found = installation()
    small = solve_small_problem()
    troubles = [*outdated(), *failed(small)]
    outputs.say(report_text(found, small))
    document = {"small_problem": asdict(small), "troubles": [asdict(trouble) for trouble in troubles]}
    outputs.write({"schema": DOCTOR, **found, **document, "versions": versions()})
    for trouble in troubles:
        click.echo(f"error: {trouble.cause}; {trouble.cure}", err=True)
    if troubles:
        context.exit(BAD_INPUT)


def installation() -> dict[str, Any]:
    """Return what is installed, as plain data."""
    blas = np.show_config(mode="dicts")["Build Dependencies"]["blas"]
    return {
        "packages": {name: version(name) for name in ("matplotlib", "click", "jinja2")},
        "solvers": list(available_solvers()),
        "processors": len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count(),
        "blas": f"{blas['name']} {blas['version']}",
        "threads": {name: os.environ.get(name) for name in THREADS},
        "extras": {
            name: {"missing": [module for module in modules if find_spec(module) is None], "gives": gives}
            for name, (modules, gives) in EXTRAS.items()
        },
        "browser": find_browser(),
    }


def outdated() -> Iterator[Trouble]:
    """Find the packages that smid requires and that are missing or too old."""
    for requirement in requires("smid") or ():
        if "extra ==" in requirement:
            continue
        match = re.match(r"([\w-]+)>=([\d.]+)", requirement)
        if match is None:
            continue
        name, least = match.groups()
        try:
            has = version(name)
        except PackageNotFoundError:
            yield Trouble(f"{name} is not installed", f'pip install "{name}>={least}"')
            continue
        if _numbers(has) < _numbers(least):
            yield Trouble(f"{name} {has} is older than {least}", f'pip install --upgrade "{name}>={least}"')


def solve_small_problem() -> SmallProblem:
    """Certify the pole of a first-order model from eight samples."""
    u = [1.0, 0.0, 1.0, 1.0, 0.0, 0.0, 1.0, 0.0]
    y = [0.0, 1.0, 0.5, 1.3, 1.6, 0.8, 0.4, 1.2]
    data = Dataset.from_arrays(input={"u": u}, output={"y": y}, sampling_time=1.0)
    began = time.perf_counter()
    try:
        estimate = identify(OutputError(na=1, stable=True), data, noise_bound=0.1)
    except (ProblemError, ArithmeticError, ImportError) as error:
        return SmallProblem(None, None, f"{type(error).__name__}: {error}", False, time.perf_counter() - began)
    pole = estimate["a1"]
    certified = (
        estimate.reason is Reason.TIGHT
        and pole.proof_lower is pole.proof_upper is Proof.PROVEN
        and pole.lower <= TRUE_POLE <= pole.upper
    )
    return SmallProblem(pole.lower, pole.upper, estimate.reason.value, certified, time.perf_counter() - began)


def failed(small: SmallProblem) -> Iterator[Trouble]:
    """Return the trouble of a small problem that was not certified."""
    if not small.certified:
        cause = f"the small problem was not certified: a1 in [{small.lower}, {small.upper}], {small.reason}"
        yield Trouble(cause, "pip install --force-reinstall clarabel numpy scipy, and run smid doctor again")


def report_text(found: dict[str, Any], small: SmallProblem) -> str:
    """Return the report that is printed."""
    lines = [f"{name:<14}{number}" for name, number in (versions() | found["packages"]).items()]
    threads = ", ".join(f"{name}={count}" for name, count in found["threads"].items() if count is not None)
    lines += [
        f"{'solvers':<14}{', '.join(found['solvers'])}",
        f"{'processors':<14}{found['processors']}",
        f"{'BLAS':<14}{found['blas']}, {threads or 'threads not limited; ' + THREADS[0] + '=1 is often faster'}",
    ]
    for name, extra in found["extras"].items():
        missing = (
            f'missing {", ".join(extra["missing"])}: pip install "smid[{name}]"' if extra["missing"] else "installed"
        )
        lines.append(f"{'[' + name + ']':<14}{missing} ({extra['gives']})")
    lines.append(f"{'browser':<14}{found['browser'] or 'no Chromium: print reports to PDF from your own browser'}")
    if small.certified:
        ends = f"a1 in [{small.lower:.6f}, {small.upper:.6f}], certified in {small.seconds:.2f} s"
        lines.append(f"{'small problem':<14}{ends}")
    return "\n".join(lines)


def _numbers(text: str) -> tuple[int, ...]:
    """Return the leading numbers of a version."""
    return tuple(int(part) for part in re.findall(r"\d+", text)[:3])
