"""The encoding of a text file: told by the file, or asked for; never guessed.

A mark at the beginning, valid UTF-8, or the zero bytes of UTF-16 tell it. Other files have one byte a letter, and each
byte means another letter in each encoding. Such a file is Windows-1252, which most tools write, if its letters read as
Western text: a degree sign or an umlaut among plain letters. Detectors by frequency of letters are wrong on files of
numbers: charset-normalizer 3.5 takes `Temperatur [°C]` in Windows-1252 for Big5.
"""

import codecs
import re

from smid.data.errors import DataError

_MARKS = (
    (codecs.BOM_UTF8, "utf-8-sig"),
    (codecs.BOM_UTF32_LE, "utf-32"),  # begins as that of UTF-16
    (codecs.BOM_UTF32_BE, "utf-32"),
    (codecs.BOM_UTF16_LE, "utf-16"),
    (codecs.BOM_UTF16_BE, "utf-16"),
)
# What Western text does not hold: three letters in a row that are not plain; a sign of no unit and no text; a quotation
# mark beside another such sign; and what a degree or micro sign of DOS becomes before a unit.
_LETTERS, _UNITS, _MARKS_OF_TEXT = "À-ÖØ-öø-ÿŠšŽžŒœŸƒ", "°µ²³¹·±×÷½¼¾€£§%–—ºª\u00a0", "‰‘’“”„…«»®©™"
_FOREIGN = re.compile(
    rf"[{_LETTERS}]{{3}}|[^\x00-\x7f{_LETTERS}{_UNITS}{_MARKS_OF_TEXT}]"
    rf"|[{_MARKS_OF_TEXT}][{_UNITS}{_MARKS_OF_TEXT}]|[{_UNITS}][{_MARKS_OF_TEXT}]"
    r"|(?<![A-Za-z])[øæ](?=[CFVAmsWPg]\b)"
)


def decode(raw: bytes, origin: str, encoding: str | None = None) -> str:
    r"""Return the text of a file.

    Parameters
    ----------
    encoding
        Its name in Python, such as "cp1251"; by default what the bytes tell.

    Raises
    ------
    DataError
        If the encoding is unknown or does not fit, or the bytes do not tell it.

    Examples
    --------
    >>> decode("T [\u00b0C]".encode("cp1252"), "run.csv")
    'T [°C]'
    """
    if encoding is not None:
        try:
            return raw.decode(encoding)
        except LookupError:
            raise DataError(f"encoding {encoding!r} is not known: give utf-8, cp1252, cp437, shift_jis ...") from None
        except UnicodeDecodeError as error:
            line = raw.count(b"\n", 0, error.start) + 1
            raise DataError(f"{origin}: line {line} is no text in {encoding}: give another encoding") from None
    for mark, name in _MARKS:
        if raw.startswith(mark):
            return decode(raw, origin, name)
    if b"\0" in raw:
        # Plain letters in UTF-16 have a zero before or after them.
        return decode(raw, origin, "utf-16-be" if raw[:1] == b"\0" else "utf-16-le")
    try:
        return raw.decode("utf-8")
    except UnicodeDecodeError:
        text = raw.decode("cp1252", errors="replace")
    found = _FOREIGN.search(text)
    if found:
        line = text.count("\n", 0, found.start()) + 1
        raise DataError(
            f"{origin}: line {line} has letters that are neither UTF-8 nor Western text ({found[0]!r} in "
            "Windows-1252); give encoding=... (--encoding), such as cp437 (DOS), mac_roman, cp1251 (Cyrillic) or "
            "shift_jis, or cp1252 if they are right"
        )
    return text
