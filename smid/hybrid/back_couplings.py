"""Back couplings: the past samples that a network reads, which make it dynamic.

A static network of present and past samples is a dynamic system.  With p past inputs and q past outputs it reads

    v[t], v[t-1], ..., v[t-p]    and    z[t-1], ..., z[t-q]

where v is what stands before it and z what it gives.  The thesis calls (0, 1) the simple and (1, 1) the extra back
couplings.  Trained as a predictor it reads the measured past outputs, run as a simulator its own: the lines of the
model are the same.

How many a linear pair of plant and model asks for is told by `smid.hybrid.analysis`.

Reference: hybrid thesis, figures 4.5 and 6.5, section 6.2.2.
"""

from __future__ import annotations

import warnings
from dataclasses import dataclass

import sympy

from smid.models import ModelError, t

__all__ = ["EXTRA", "SIMPLE", "STATIC", "BackCouplingWarning", "BackCouplings", "warn_of_few_couplings"]


class BackCouplingWarning(UserWarning):
    """A network has fewer back couplings than the analysis asks for.

    Examples
    --------
    >>> issubclass(BackCouplingWarning, UserWarning)
    True
    """


@dataclass(frozen=True)
class BackCouplings:
    """How many past samples a network reads, beside the present input.

    Parameters
    ----------
    inputs
        Past samples of each input.
    outputs
        Past samples of its own output.

    Raises
    ------
    ModelError
        If a number is negative or not whole.

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
                raise ModelError(f"{name} = {count!r} is no number of back couplings: give 0, 1, 2, ...")

    def samples(self, inputs: list[sympy.IndexedBase], output: sympy.Expr) -> tuple[sympy.Expr, ...]:
        """List what the network reads.

        Parameters
        ----------
        inputs
            Signals before the network.
        output
            What it gives, at time t.

        Returns
        -------
        tuple of sympy.Expr
            Each input now and before, then the output before.
        """
        read = [item[t - lag] for item in inputs for lag in range(self.inputs + 1)]
        return (*read, *(output.subs(t, t - lag) for lag in range(1, self.outputs + 1)))

    def __str__(self) -> str:
        return f"{self.inputs} past inputs and {self.outputs} past outputs"


STATIC = BackCouplings(0, 0)
SIMPLE = BackCouplings(0, 1)
EXTRA = BackCouplings(1, 1)


def warn_of_few_couplings(given: BackCouplings, needed: BackCouplings, *, stacklevel: int = 2) -> None:
    """Warn where a network has fewer back couplings than it needs.

    Parameters
    ----------
    given, needed
        Of the network, and of the transfer function that it has to learn.
    stacklevel
        Whose line the warning names; 2 is the caller's.

    Warns
    -----
    BackCouplingWarning
        With the numbers.

    Examples
    --------
    >>> with warnings.catch_warnings(record=True) as told:
    ...     warnings.simplefilter("always")
    ...     warn_of_few_couplings(SIMPLE, EXTRA)
    >>> print(told[0].message)
    the network reads 0 past inputs and 1 past outputs, and what it has to learn needs 1 and 1: give BackCouplings(1, 1)
    """
    if given.inputs < needed.inputs or given.outputs < needed.outputs:
        enough = BackCouplings(max(given.inputs, needed.inputs), max(given.outputs, needed.outputs))
        warnings.warn(
            f"the network reads {given}, and what it has to learn needs {needed.inputs} and {needed.outputs}: "
            f"give BackCouplings({enough.inputs}, {enough.outputs})",
            BackCouplingWarning,
            stacklevel=stacklevel + 1,
        )
