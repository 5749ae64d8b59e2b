"""Back couplings: past samples that a static network reads, which make it a dynamic system.

With p past inputs and q past outputs the network reads

    v[t], v[t-1], ..., v[t-p]    and    z[t-1], ..., z[t-q]

where v are its input signals and z is its output. The thesis calls (0, 1) simple and (1, 1) extra back couplings.
In prediction the past outputs are measured samples. In simulation they are the model's own.

`smid.hybrid.analysis` finds the numbers for a linear plant and model.

Reference: hybrid thesis, figures 4.5 and 6.5, section 6.2.2.
"""

from __future__ import annotations

import warnings
from dataclasses import dataclass

import sympy

from smid.models import ModelError, t

__all__ = ["EXTRA", "SIMPLE", "STATIC", "BackCouplingWarning", "BackCouplings", "warn_of_few_couplings"]


class BackCouplingWarning(UserWarning):
    """Warning that a network has fewer back couplings than the analysis requires.

    Examples
    --------
    >>> issubclass(BackCouplingWarning, UserWarning)
    True
    """


@dataclass(frozen=True)
class BackCouplings:
    """Numbers of past samples that a network reads in addition to the present input.

    Parameters
    ----------
    inputs
        Past samples of each input.
    outputs
        Past samples of the network's output.

    Raises
    ------
    ModelError
        If a number is negative or not an integer.

    Examples
    --------
    >>> from smid.models import signal
    >>> EXTRA.samples([signal("v")], signal("z")[t])
    (v[t], v[t - 1], z[t - 1])
    """

    inputs: int
    outputs: int

    def __post_init__(self) -> None:
        for name, count in (("inputs", self.inputs), ("outputs", self.outputs)):
            if isinstance(count, bool) or not isinstance(count, int) or count < 0:
                raise ModelError(f"{name} = {count!r} is not a number of back couplings: give 0, 1, 2, ...")

    def samples(self, inputs: list[sympy.IndexedBase], output: sympy.Expr) -> tuple[sympy.Expr, ...]:
        """Return what the network reads: present and past inputs, then past outputs."""
        read = [item[t - lag] for item in inputs for lag in range(self.inputs + 1)]
        return (*read, *(output.subs(t, t - lag) for lag in range(1, self.outputs + 1)))

    def __str__(self) -> str:
        return f"{self.inputs} past inputs and {self.outputs} past outputs"


STATIC = BackCouplings(0, 0)
SIMPLE = BackCouplings(0, 1)
EXTRA = BackCouplings(1, 1)


def warn_of_few_couplings(given: BackCouplings, needed: BackCouplings, *, stacklevel: int = 2) -> None:
    """Warn if a network has fewer back couplings than it needs; stacklevel 2 names the caller's line."""
    if given.inputs < needed.inputs or given.outputs < needed.outputs:
        enough = BackCouplings(max(given.inputs, needed.inputs), max(given.outputs, needed.outputs))
        warnings.warn(
            f"the network reads {given}, but the plant needs {needed.inputs} and {needed.outputs}: "
            f"give BackCouplings({enough.inputs}, {enough.outputs})",
            BackCouplingWarning,
            stacklevel=stacklevel + 1,
        )
