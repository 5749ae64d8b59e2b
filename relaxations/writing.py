"""Write a whole file or nothing, and test beforehand whether it can be written."""

from __future__ import annotations

import os
import tempfile
from os import PathLike
from pathlib import Path


def check_writable(path: str | PathLike[str]) -> None:
    """Raise an error that names the cure if no file can be written there; call it before long work.

    Raises
    ------
    OSError
        If the path is a folder, its folder is missing, or nothing can be written there.

    Examples
    --------
    >>> check_writable("/nowhere/a.html")
    Traceback (most recent call last):
    ...
    OSError: cannot write /nowhere/a.html: there is no folder /nowhere; create it, or choose another path
    """
    target = Path(path)
    folder = target.parent
    if target.is_dir():
        raise OSError(f"cannot write {target}: it is a folder; give the name of a file in it")
    if not folder.is_dir():
        raise OSError(f"cannot write {target}: there is no folder {folder}; create it, or choose another path")
    if target.exists() and not os.access(target, os.W_OK):
        raise OSError(f"cannot write {target}: it is read-only; change its permissions, or choose another path")
    try:
        # Write a temporary file, because permissions do not show a file system that is mounted read-only.
        with tempfile.TemporaryFile(dir=folder):
            pass
    except OSError as error:
        raise OSError(f"cannot write {target}: {error.strerror} in {folder}; choose another path") from None


def hexadecimal(value: float) -> str:
    """Return a float in hexadecimal, exactly, without the zeros at its end.

    >>> hexadecimal(0.75), hexadecimal(-0.1), hexadecimal(0.0)
    ('0x1.8p-1', '-0x1.999999999999ap-4', '0x0p+0')
    """
    digits, _, exponent = float(value).hex().partition("p")
    return f"{digits.rstrip('0').rstrip('.') if '.' in digits else digits}p{exponent}"


def write_text(path: str | PathLike[str], text: str) -> Path:
    """Write text in UTF-8 through a temporary file, so that no reader sees half of it; return the path.

    Examples
    --------
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     write_text(Path(folder) / "a.txt", "whole").read_text()
    'whole'
    """
    return write_bytes(path, text.encode())


def write_bytes(path: str | PathLike[str], content: bytes) -> Path:
    """Write bytes as :func:`write_text` writes text."""
    check_writable(path)
    target = Path(path)
    temporary = target.with_name(f".{target.name}.{os.getpid()}.tmp")
    try:
        temporary.write_bytes(content)
        os.replace(temporary, target)
    finally:
        temporary.unlink(missing_ok=True)
    return target
