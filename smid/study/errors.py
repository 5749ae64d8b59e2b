"""What goes wrong around a study: its folder, the disk, the workers, the cluster."""

from __future__ import annotations

__all__ = ["StudyError"]


class StudyError(OSError):
    """A study cannot begin or go on where it runs; the message names the cause and the cure.

    Examples
    --------
    >>> raise StudyError("study: the disk is full; free some space, then resume")
    Traceback (most recent call last):
    ...
    smid.study.errors.StudyError: study: the disk is full; free some space, then resume
    """
