"""Run the benchmarks and write docs/benchmarks.md: ``make bench``."""

from __future__ import annotations

from pathlib import Path

from benchmarks import diagnosis, hammerstein, recursive, stamping
from benchmarks.machine import described


def main() -> None:
    """Print each result as it comes, then write them all."""
    parts = ["# Benchmarks", f"Written by `make bench`. {described()}"]
    print("\n\n".join(parts), flush=True)
    for module in (stamping, hammerstein, diagnosis, recursive):
        part = module.run()
        print(f"\n{part}", flush=True)
        parts.append(part)
    (Path(__file__).parent.parent / "docs" / "benchmarks.md").write_text("\n\n".join(parts) + "\n", encoding="utf-8")


if __name__ == "__main__":
    main()
