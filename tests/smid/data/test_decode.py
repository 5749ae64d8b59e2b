"""Text is read in the encoding that the bytes tell, or the encoding is asked for."""

import pytest

from smid.data import DataError
from smid.data.decode import decode

WESTERN = [
    "T [°C]",
    "Größe;Rücklauf [m³/h]",
    "débit créé ½ ±",
    "Señal – “ñ”",
    "Ventilöffnung [%]; P [µW]",
    "k [W/(m²·°C)]",
    "Kosten: 5 €",
]
FOREIGN = [
    ("T [°C]", "cp437"),
    ("T [°F]", "cp850"),
    ("t [µs]", "cp437"),
    ("T [°C]", "mac_roman"),
    ("Температура", "cp1251"),
    ("Температура", "koi8-r"),
    ("温度", "shift_jis"),
    ("温度", "gb2312"),
    ("θερμοκρασία", "cp1253"),
]


@pytest.mark.parametrize("text", WESTERN)
@pytest.mark.parametrize("encoding", ["cp1252", "utf-8", "utf-8-sig", "utf-16", "utf-32", "utf-16-le", "utf-16-be"])
def test_western_text_is_read(text, encoding):
    assert decode(f"time;{text}\n0;1\n".encode(encoding), "run.csv") == f"time;{text}\n0;1\n"


@pytest.mark.parametrize(("text", "encoding"), FOREIGN)
def test_other_letters_are_asked_for_and_read_when_told(text, encoding):
    raw = f"time\n{text}\n".encode(encoding)
    with pytest.raises(DataError, match=r"run.csv: line 2 .* give encoding="):
        decode(raw, "run.csv")
    assert decode(raw, "run.csv", encoding) == f"time\n{text}\n"
