"""Check a run certificate: a proof about a model and a record, by enclosures of the model's free run.

The certificate of polynomials states polynomials. This one states the model's lines as text, the samples, and a box of
the parameters. The proof is a list of boxes, each contracted by multipliers of what single samples state
(:mod:`smid.identification.inversion` finds them). The program encloses the run over each box itself, in affine
arithmetic on whole numbers, with enclosures of the elementary functions of its own; floats are not used.

The modules, from the bottom:

- :mod:`.fixed`: fixed-point numbers, and elementary functions of them;
- :mod:`.affine`, :mod:`.functions`: affine forms, and functions of forms;
- :mod:`.text`, :mod:`.tape`: expressions, and lines as operations on forms;
- :mod:`.statement`: what a file states, and of which set it proves something;
- :mod:`.operations`, :mod:`.motion`: the operations, and rates integrated between two samples;
- :mod:`.run`: the enclosed run, and what each sample states of a box;
- :mod:`.terms`, :mod:`.comparison`, :mod:`.modulated`, :mod:`.narrowing`: the box narrowed without a run;
- :mod:`.proof`: the boxes;
- :mod:`.read`, :mod:`.report`: the file, and the printed report.
"""

from __future__ import annotations

from relaxations.check.arithmetic import Refused
from relaxations.check.forms import shown_name
from relaxations.check.runs.fixed import ONE
from relaxations.check.runs.narrowing import narrowed_by
from relaxations.check.runs.proof import hull
from relaxations.check.runs.read import Claim, Document, document

__all__ = ["check"]


def check(content: object) -> Claim | None:
    """Return the proven ends of each parameter; None where the set is proven empty.

    Parameters
    ----------
    content
        The content of a file, as :func:`relaxations.check.read` returns it.

    Raises
    ------
    Unreadable
        When the content is not a run certificate, or exceeds a limit.
    Refused
        When the boxes do not prove the claim, or nothing is claimed beyond the stated box.

    Examples
    --------
    A signal that is twice the parameter, and is measured once as 1 within 1/10: the sample itself proves the ends.

    >>> model = {"name": "double", "parameters": {"a": [0, 4]}, "lines": {"w": "2*a"}, "constraints": [],
    ...          "measurements": [{"channel": "y", "signal": "w", "noise": "eta", "inverse": None}]}
    >>> content = {"format": "relaxations run certificate", "version": 1, "model": model, "first": {"w": 0},
    ...            "noise_bounds": {"y": "1/10"}, "initial": [], "symbols": 0, "claim": {"a": ["2/5", "3/5"]},
    ...            "experiments": [{"name": "run", "samples": 1, "channels": {"y": [1]}}],
    ...            "boxes": [{"passes": [{"rows": [[0, 0, 0, 0]], "sides": [[0, 1, 2, [0, 1]], [0, -1, 2, [0, -1]]]}]}]}
    >>> check(content)["a"]
    (Fraction(2, 5), Fraction(3, 5))
    """
    return proven(document(content))


def proven(found: Document) -> Claim | None:
    """Return the claim of a document that proves it."""
    stated, claim = found.stated, found.claim
    left = hull(found.nodes, stated, narrowed_by(stated, found.narrowing))
    if claim is None:
        if left is not None:
            raise Refused("the boxes that are left are not empty, so the set is not proven empty")
        return None
    ends = dict(zip(stated.parameters, left or [], strict=False))
    for name, (low, high) in ends.items():
        claimed_low, claimed_high = claim[name]
        if not (claimed_low * ONE <= low and high <= claimed_high * ONE):
            proven_ends = " to ".join(f"{end / ONE:.17g}" for end in (low, high))
            raise Refused(f"the claim on {shown_name(name)} is not proven: the boxes that are left reach {proven_ends}")
    priors = zip(claim.values(), stated.box, strict=False)
    if all(low * ONE <= box_low and box_high <= high * ONE for (low, high), (box_low, box_high) in priors):
        raise Refused("the file proves nothing beyond the stated box")
    return claim
