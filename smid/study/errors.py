"""The error of a study that cannot run: its folder, the disk, the workers or the cluster."""

from __future__ import annotations


class StudyError(OSError):
    """A study cannot begin or continue where it runs; the message names the cause and the cure.

    Examples
    --------
    >>> raise StudyError("study: the disk is full; free some space, then resume")
    Traceback (most recent call last):
    ...
    smid.study.errors.StudyError: study: the disk is full; free some space, then resume
    """
