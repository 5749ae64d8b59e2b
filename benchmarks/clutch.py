"""Run the clutch's benchmarks and write docs/clutch.md: ``python -m benchmarks.clutch``, half an hour on two cores."""

from __future__ import annotations

from pathlib import Path

from benchmarks import foreign_plants, networks, recursive_sets, virtual_sensors

HEAD = """# Benchmark of the clutch models

All records are simulated. BLAS uses one thread. Compare times only within one table. `python -m benchmarks.clutch`
writes this page."""


def main() -> None:
    """Print each part as it comes, then write them all."""
    parts = [HEAD]
    for run in (networks.run, virtual_sensors.run, foreign_plants.run, *recursive_sets.SECTIONS.values()):
        parts.append(run())
        print(f"\n{parts[-1]}", flush=True)
    (Path(__file__).parent.parent / "docs" / "clutch.md").write_text("\n\n".join(parts) + "\n", encoding="utf-8")


if __name__ == "__main__":
    main()
