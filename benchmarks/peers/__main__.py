"""Compare linear ARX, FROLS of SysIdentPy and the recurrent network of jax-sysid with smid on measured records.

    python -m benchmarks.peers FOLDER [--only RECORD ...] [--smid FILE] [--output docs/peers.md]

FILE is a page that `python -m benchmarks.measured_diagnosis FOLDER --output FILE` wrote: the figures of smid come from
there, and without it their columns are empty. The extra `peers` installs the peers.
"""

from __future__ import annotations

import argparse
import os
from collections.abc import Sequence
from importlib import import_module
from pathlib import Path
from types import ModuleType

THREADS = ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS")
os.environ.update(dict.fromkeys(THREADS, "1"))  # read once, when numpy is imported
os.environ.setdefault("XLA_FLAGS", "--xla_cpu_multi_thread_eigen=false")

from benchmarks.machine import described  # noqa: E402
from benchmarks.measured_cases import CASES  # noqa: E402
from benchmarks.peers import protocol  # noqa: E402
from benchmarks.peers.compare import SMID, Row, rows, smid_figures  # noqa: E402

PEERS = ("arx", "frols", "recurrent_network")
LIBRARIES = ("numpy", "scipy", "sysidentpy", "jax", "jax-sysid")
HEAD = """# Comparison with other identification tools on measured records

This page shows the RMSE of free runs on the test part of public measured records, for smid and for other tools. No fit
and no choice uses the test part. `python -m benchmarks.peers FOLDER --output docs/peers.md` writes the page. The
records are not part of the project. [Diagnosis of measured records](measured.md) describes their parts and the base
models.

The protocol:

{protocol}

A free run is called divergent if its error exceeds {limit:.0f} times the range of the output. The seconds of a peer are
those of its choice, its fit and its simulations. Figures of smid are shown if `--smid` names a page that
`python -m benchmarks.measured_diagnosis` wrote.

The peers:

{peers}
"""


def loaded() -> list[ModuleType]:
    """Import the peers."""
    try:
        return [import_module(f"benchmarks.peers.{name}") for name in PEERS]
    except ModuleNotFoundError as missing:
        raise SystemExit(f"no {missing.name}; install the peers with: pip install sysidentpy jax-sysid") from None


def page(results: Sequence[Row], peers: Sequence[ModuleType], smid: dict[tuple[str, bool], tuple[str, str]]) -> str:
    """Return the tables as Markdown."""
    rules = (protocol.__doc__ or "").split("\n\n", 1)[1].strip()
    about = "\n".join(f"- {' '.join((module.__doc__ or '').split())}" for module in peers)
    titles = [module.PEER.title for module in peers]
    lines = [HEAD.format(protocol=rules, limit=protocol.DIVERGED, peers=about)]
    heads = ("record", "test part", "unit", "smid base", "smid extended", *titles)
    lines += ["## RMSE on the test part", "", _cells(*heads), "|---" * len(heads) + "|"]
    names = [row.record for row in results]
    for k, row in enumerate(results):
        ours = smid.get((row.record, row.record in names[:k]), ("", ""))
        values = ("diverges" if value is None else f"{value:.4g}" for value in row.rmse)
        lines.append(_cells(row.record, row.part, row.unit, *ours, *values))
    lines += ["", "## Chosen settings and seconds", "", _cells("record", *(f"{title} | s" for title in titles))]
    lines.append("|---" * (1 + 2 * len(titles)) + "|")
    for row in {row.record: row for row in results}.values():
        pairs = zip(row.settings, row.seconds, strict=True)
        lines.append(_cells(row.record, *(f"{chosen} | {seconds:.1f}" for chosen, seconds in pairs)))
    return "\n".join([*lines, "", described(LIBRARIES)]) + "\n"


def _cells(*cells: str) -> str:
    return f"| {' | '.join(cells)} |"


def main() -> None:
    """Print each record as it comes, and write the page."""
    known = [case.record for case in CASES]
    parser = argparse.ArgumentParser(prog="python -m benchmarks.peers", description=(__doc__ or "").splitlines()[0])
    parser.add_argument("folder", type=Path, help="folder of the measured records")
    parser.add_argument("--only", nargs="+", choices=known, default=known, metavar="RECORD", help="these records only")
    parser.add_argument("--smid", type=Path, metavar="FILE", help="page of benchmarks.measured_diagnosis")
    parser.add_argument("--output", type=Path, help="Markdown file to write")
    given = parser.parse_args()
    if not given.folder.is_dir():
        parser.error(f"no folder {given.folder}: name the folder of the measured records")
    if given.smid and not given.smid.is_file():
        parser.error(f"no file {given.smid}: write it with {SMID}")
    smid = smid_figures(given.smid.read_text(encoding="utf-8")) if given.smid else {}
    peers = loaded()
    results: list[Row] = []
    for case in CASES:
        if case.record not in given.only:
            continue
        if not (given.folder / case.record).is_dir():
            print(f"{case.record}: skipped, it is not in the folder", flush=True)
            continue
        results += rows(case, given.folder, [module.PEER for module in peers])
        print(*(row for row in results if row.record == case.record), sep="\n", flush=True)
        if given.output:
            given.output.write_text(page(results, peers, smid), encoding="utf-8")


if __name__ == "__main__":
    main()
