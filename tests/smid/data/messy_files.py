"""Files as other tools export them, each with the right answer beside it: samples, or the words of a refusal.

All files hold one of the same few signals, so that a file that loads silently wrong differs from its answer.
`python -m tests.smid.data.messy_files FOLDER` writes them all.
"""

import sys
from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
from scipy.io import savemat

N = 24
U = np.round(np.where(np.sin(0.9 * np.arange(N)) > 0, 1.5, -0.5), 3)
Y = np.round(2 + np.cumsum(U) * 0.125, 4)
GAP = [11, 12]  # rows that are missing where a file has a gap


@dataclass(frozen=True)
class Messy:
    """A file and its answer: a sampling time and samples, or a part of the refusal.

    ``parts`` are the samples of each experiment, as ranges of rows of U and Y. ``missing`` says that the samples of Y
    in the rows of GAP are missing.
    """

    name: str
    content: str | bytes | Callable[[Path], None]
    interval: float = 0.5
    refused: tuple[str, ...] = ()
    options: dict[str, Any] = field(default_factory=dict)
    units: tuple[str, str] = ("", "")
    parts: tuple[tuple[int, int], ...] = ((0, N),)
    scale: float = 1.0
    missing: bool = False

    def write(self, folder: Path) -> Path:
        path = folder / self.name
        if callable(self.content):
            self.content(path)
        else:
            path.write_bytes(self.content if isinstance(self.content, bytes) else self.content.encode())
        return path


def rows(times, separator=",", decimal=".", left_out=(), u=U, y=Y, more="", digits="{}"):
    lines = []
    for k, time in enumerate(times):
        if k not in left_out:
            cells = [str(time), *(digits.format(x).replace(".", decimal) for x in (u[k], y[k]))]
            lines.append(separator.join(cells) + more)
    return "\n".join(lines) + "\n"


SECONDS = [f"{0.5 * k:g}" for k in range(N)]
COMMA_SECONDS = [text.replace(".", ",") for text in SECONDS]
STAMPS = pd.date_range("2024-03-31 00:59:50", periods=N, freq="500ms", tz="UTC")  # before Berlin's clocks change
ISO = [t.strftime("%Y-%m-%dT%H:%M:%S.%f")[:-3] for t in STAMPS]
BERLIN = [t.isoformat() for t in STAMPS.tz_convert("Europe/Berlin")]
GERMAN = [t.strftime("%d.%m.%Y %H:%M:%S,%f")[:-3] for t in STAMPS]
BRITISH = [t.strftime("%d/%m/%Y %H:%M:%S.%f")[:-3] for t in STAMPS]
AMERICAN = [t.strftime("%m/%d/%Y %I:%M:%S.%f")[:-3] + t.strftime(" %p") for t in STAMPS]
DAILY = pd.date_range("2024-01-10", periods=N, freq="D")
NIGHT = pd.date_range("2024-01-10 23:59:55", periods=N, freq="500ms")
CLOCK = [t.strftime("%H:%M:%S.%f")[:-3] for t in NIGHT]
EPOCH = 1_700_000_000
HEADER = "time,u,y\n"
AROUND_GAP = ((0, 11), (13, N))
MARKED = [str(v) if k not in GAP else "-9999" for k, v in enumerate(Y)]
CELLS = [str(v) if k not in GAP else "" for k, v in enumerate(Y)]
WORDS = [str(v) if k not in GAP else "No Data" for k, v in enumerate(Y)]


NAIVE = [t.tz_localize(None).to_pydatetime() for t in STAMPS]
GAPPED = [None if k in GAP else v for k, v in enumerate(Y)]
BOOK = list(zip(0.5 * np.arange(N), U, Y, strict=True))


def workbook(cells, sheets=1):
    """Return what writes cells into each of so many sheets."""

    def write(path):
        frame = pd.DataFrame([list(row) for row in cells], dtype=object)
        with pd.ExcelWriter(path, engine="openpyxl") as book:
            for k in range(sheets):
                frame.to_excel(book, sheet_name=f"run{k}", header=False, index=False)

    return write


def epoch(per_second):
    return rows([EPOCH * per_second + k * per_second // 2 for k in range(N)])


def frame_of(**columns):
    return pd.DataFrame({"u": U, "y": Y, **columns})


FILES = [
    # Spreadsheets
    Messy("sheet_plain.csv", HEADER + rows(SECONDS)),
    Messy("sheet_semicolon_comma.csv", "time;u [A];y (bar)\n" + rows(COMMA_SECONDS, ";", ","), units=("A", "bar")),
    Messy("sheet_tab_comma.txt", "time\tu\ty\n" + rows(COMMA_SECONDS, "\t", ",")),
    Messy("sheet_blank_comma.txt", "time u y\n" + rows(COMMA_SECONDS, " ", ",")),
    Messy("sheet_bom.csv", b"\xef\xbb\xbf" + (HEADER + rows(SECONDS)).encode()),
    Messy("sheet_utf16.txt", ("time\tu\ty [µm]\n" + rows(SECONDS, "\t")).encode("utf-16"), units=("", "µm")),
    Messy("sheet_latin1.csv", ("time,u,y [°C]\n" + rows(SECONDS)).encode("latin-1"), units=("", "°C")),
    Messy("sheet_title.csv", "Test rig 4, Turin\n\n" + HEADER + rows(SECONDS)),
    Messy(
        "sheet_titles_padded.csv", "Prüfstand 7;;\nBediener: Rossi;;\n;;\ntime;u;y\n" + rows(COMMA_SECONDS, ";", ",")
    ),
    Messy("sheet_trailing_commas.csv", "time,u,y,,\n" + rows(SECONDS, more=",,")),
    Messy("sheet_quotes.csv", '"time","u","y"\n' + rows([f'"{t}"' for t in SECONDS])),
    Messy("sheet_crlf.csv", (HEADER + rows(SECONDS)).replace("\n", "\r\n")),
    Messy("sheet_empty_cells.csv", HEADER + rows(SECONDS, y=CELLS), missing=True),
    Messy("sheet_na.csv", HEADER + rows(SECONDS, y=[c or "#N/A" for c in CELLS]), missing=True),
    Messy("sheet_empty_rows.csv", HEADER + rows(SECONDS).replace("\n", "\n\n")),
    Messy(
        "sheet_thousands.txt", "time\tu\ty\n" + rows(SECONDS, "\t", u=U * 1e3, y=Y * 1e6, digits="{:,.2f}"), scale=1e6
    ),
    Messy(
        "sheet_thousands_unclear.txt",
        "time\tu\ty\n" + rows(range(N), "\t", y=Y * 0 + 1234, u=U * 0 + 2345, digits="{:,.0f}"),
        refused=("decimal",),
    ),
    Messy(
        "sheet_excel_days.csv",
        HEADER + rows([f"{45352 + k / 172800:.11f}" for k in range(N)]),
        refused=("days", "units"),
    ),
    Messy(
        "sheet_excel_days_told.csv",
        HEADER + rows([f"{45352 + k / 172800:.11f}" for k in range(N)]),
        options={"units": {"time": "d"}},
    ),
    Messy("sheet_minutes_cut_off.csv", HEADER + rows([t[:16] for t in ISO]), refused=("repeats",)),
    Messy(
        "sheet_mm_ss.csv", HEADER + rows([f"00:{0.5 * k:04.1f}" for k in range(N)]), refused=("not a number", "00:00.0")
    ),
    Messy("sheet_sums.csv", HEADER + rows(SECONDS) + "Mean,0.5,2.1\n", refused=("row 25 (line 26)", "'Mean'")),
    Messy(
        "sheet_error_cell.csv",
        HEADER + rows(SECONDS, y=[c or "#DIV/0!" for c in CELLS]),
        refused=("line 13", "#DIV/0!"),
    ),
    Messy("sheet_two_decimals.csv", "time;u;y\n" + rows(COMMA_SECONDS, ";", "."), refused=("decimal",)),
    Messy("sheet_twice_named.csv", "time,y,u,y\n" + rows(SECONDS, more=",7"), refused=("two columns are named 'y'",)),
    Messy("sheet_no_header.csv", rows(SECONDS), options={"input": "1", "output": "2", "time": "0"}),
    Messy(
        "sheet_day_and_clock.csv",
        "Date;Time;u;y\n" + rows([f"{t:%d.%m.%Y};{c}" for t, c in zip(NIGHT, CLOCK, strict=True)], ";"),
    ),
    Messy(
        "sheet_cp1252.csv", ("Prüfstand – 5 €\ntime;u;y [°C]\n" + rows(SECONDS, ";")).encode("cp1252"), units=("", "°C")
    ),
    Messy("sheet_dos.csv", ("time,u,y [°C]\n" + rows(SECONDS)).encode("cp437"), refused=("line 1", "cp437")),
    Messy(
        "sheet_dos_told.csv",
        ("time,u,y [°C]\n" + rows(SECONDS)).encode("cp437"),
        options={"encoding": "cp437"},
        units=("", "°C"),
    ),
    Messy("sheet_mac.csv", ("time,u,y [°C]\n" + rows(SECONDS)).encode("mac_roman"), refused=("--encoding",)),
    Messy("sheet_wrong_encoding.csv", HEADER + rows(SECONDS), options={"encoding": "utf-9"}, refused=("'utf-9'",)),
    Messy("sheet_utf16_no_mark.txt", ("time\tu\ty\n" + rows(SECONDS, "\t")).encode("utf-16-le")),
    Messy(
        "sheet_swiss.txt",
        "time\tu\ty\n" + rows(SECONDS, "\t", y=Y * 1e6, digits="{:,.2f}").replace(",", "'"),
        refused=("is not a number", "line 2"),
    ),
    Messy(
        "sheet_french.csv",
        "time;u;y\n" + rows(COMMA_SECONDS, ";", ",", y=Y * 1e6, digits="{:_.2f}").replace("_", "\u202f"),
        refused=("is not a number", "line 2"),
    ),
    Messy("book.xlsx", workbook([["Rig 4", None, None], [None] * 3, ["time", "u", "y [°C]"], *BOOK]), units=("", "°C")),
    Messy("book_units.xlsx", workbook([["time", "u", "y"], ["s", "V", "bar"], *BOOK]), units=("V", "bar")),
    Messy("book_dates.xlsx", workbook([["when", "u", "y"], *zip(NAIVE, U, Y, strict=True)])),
    Messy("book_empty_cells.xlsx", workbook([["time", "u", "y"], *zip(SECONDS, U, GAPPED, strict=True)]), missing=True),
    Messy(
        "book_text_numbers.xlsx",
        workbook([["time", "u", "y"], *zip(COMMA_SECONDS, U, Y, strict=True)]),
        refused=("decimal",),
    ),
    Messy("book_two_sheets.xlsx", workbook([["time", "u", "y"], *BOOK], 2), refused=("several sheets", "run0, run1")),
    Messy("book_old.xls", b"\xd0\xcf\x11\xe0", refused=("Excel 2003", ".xlsx")),
    Messy("book_damaged.xlsx", b"PK\x03\x04 no more", refused=("cannot be read as an Excel workbook",)),
    # Historians
    Messy("historian_iso.csv", "Timestamp,u,y,Status\n" + rows(ISO, more=",Good")),
    Messy("historian_zulu.csv", "Timestamp,u,y\n" + rows([t + "Z" for t in ISO])),
    Messy("historian_clock_change.csv", "Timestamp,u,y\n" + rows(BERLIN)),
    Messy("historian_german.csv", "Zeitstempel;u;y\n" + rows(GERMAN, ";", ",")),
    Messy("historian_british.csv", "Stamp,u,y\n" + rows(BRITISH)),
    Messy("historian_american.csv", "Stamp,u,y\n" + rows(AMERICAN)),
    Messy(
        "historian_day_or_month.csv",
        HEADER + rows([f"0{3 + (k > 11)}/0{4 + (k > 11)}/2024 00:00:{k:02d}" for k in range(N)]),
        refused=("day from the month",),
    ),
    Messy("historian_gap.csv", "Timestamp,u,y\n" + rows(ISO, left_out=GAP), parts=AROUND_GAP),
    Messy("historian_sentinel.csv", HEADER + rows(SECONDS, y=MARKED), refused=("-9999 2 times", "--missing -9999")),
    Messy("historian_sentinel_told.csv", HEADER + rows(SECONDS, y=MARKED), options={"missing": -9999}, missing=True),
    Messy("historian_words.csv", HEADER + rows(SECONDS, y=WORDS), refused=("'No Data'", "missing='No Data'")),
    Messy("historian_words_told.csv", HEADER + rows(SECONDS, y=WORDS), options={"missing": "No Data"}, missing=True),
    Messy("historian_units_row.csv", "Timestamp;u;y\n;V;m³/h\n" + rows(ISO, ";"), units=("V", "m³/h")),
    Messy("historian_backwards.csv", HEADER + rows(ISO[::-1]), refused=("sort the rows",)),
    Messy(
        "historian_zone_in_some.csv",
        HEADER + rows([t + "Z" * (k % 2) for k, t in enumerate(ISO)]),
        refused=("time zone",),
    ),
    Messy("historian_daily.csv", "date,u,y\n" + rows([f"{t:%Y-%m-%d}" for t in DAILY]), interval=86400.0),
    Messy("historian_cyrillic.csv", ("Время;Ток;y\n" + rows(ISO, ";")).encode("cp1251"), refused=("cp1251",)),
    Messy(
        "historian_cyrillic_told.csv",
        ("Время;Ток;y\n" + rows(ISO, ";")).encode("cp1251"),
        options={"encoding": "cp1251", "input": "Ток"},
    ),
    Messy("historian_japanese.csv", ("時刻,u,y\n" + rows(ISO)).encode("shift_jis"), refused=("shift_jis",)),
    Messy(
        "historian_pi.csv",
        HEADER + rows(ISO, y=[c or "[-11059] No Good Data For Calculation" for c in CELLS]),
        refused=("line 13", "missing="),
    ),
    # Loggers and oscilloscopes
    Messy(
        "scope_title_units.csv",
        "Model,MSO44\nSample Interval,5.0e-1\n\nTIME,u,y\ns,V,V\n" + rows(SECONDS),
        units=("V", "V"),
    ),
    Messy("scope_brackets.txt", "Rigol DS1054\ntime\tu\ty\n(s)\t(V)\t(mA)\n" + rows(SECONDS, "\t"), units=("V", "mA")),
    Messy("scope_two_columns_above.csv", "Source,CH1\nSecond,Volt\ntime,u,y\n" + rows(SECONDS)),
    Messy("logger_ms.csv", "t_ms,u,y\n" + rows([500 * k for k in range(N)]), options={"time": "t_ms"}),
    Messy("logger_header_us.csv", "time [us],u,y\n" + rows([500000 * k for k in range(N)])),
    Messy("logger_epoch_s.csv", HEADER + rows([EPOCH + k / 2 for k in range(N)])),
    Messy("logger_epoch_ms.csv", HEADER + epoch(1000), refused=("[ms]",)),
    Messy("logger_epoch_us.csv", HEADER + epoch(10**6), refused=("[us]",)),
    Messy("logger_epoch_ns.csv", HEADER + epoch(10**9), refused=("[ns]",)),
    Messy("logger_epoch_ns_told.csv", HEADER + epoch(10**9), options={"units": {"time": "ns"}}),
    Messy("logger_comments.csv", "# logger 3\n# started 10:00\n" + HEADER + rows(SECONDS)),
    Messy("logger_gap.csv", HEADER + rows(SECONDS, left_out=GAP), parts=AROUND_GAP),
    Messy("logger_twice.csv", HEADER + rows([SECONDS[max(k, 1)] for k in range(N)]), refused=("repeats",)),
    Messy(
        "logger_infinite.csv",
        HEADER + rows(SECONDS, y=["inf" if k == 3 else v for k, v in enumerate(Y)]),
        refused=("inf at sample 3",),
    ),
    Messy(
        "scope_keysight.csv",
        "x-axis,1,2\nsecond,Volt,Volt\n" + rows(SECONDS),
        refused=("two columns are named 'Volt'", "rename"),
    ),
    Messy(
        "scope_tektronix.csv",
        "".join(
            f"{about},{line}\n"
            for about, line in zip(
                ["Record Length,24", "Sample Interval,0.5", *[","] * (N - 2)], rows(SECONDS).split(), strict=True
            )
        ),
        options={"input": "3", "output": "4", "time": "2"},
    ),
    # MATLAB and Python
    Messy(
        "matlab_timetable.csv",
        HEADER + rows([f"{second} sec" for second in SECONDS]),
        refused=("'0 sec'", "not a number"),
    ),
    Messy("matlab_v73.mat", b"MATLAB 7.3 MAT-file".ljust(124) + b"\x00\x02IM", refused=("7.3", "-v7")),
    Messy("frame.parquet", lambda p: frame_of(time=0.5 * np.arange(N)).to_parquet(p)),
    Messy("frame_dates.parquet", lambda p: frame_of(when=STAMPS).assign(y=GAPPED).to_parquet(p), missing=True),
    Messy("frame_damaged.parquet", b"PAR1 no more", refused=("cannot be read as a Parquet file",)),
    Messy("matlab.mat", lambda p: savemat(p, {"time": 0.5 * np.arange(N), "u": U, "y": Y[:, None], "note": "x"})),
    Messy(
        "matlab_nan.mat",
        lambda p: savemat(p, {"u": U, "y": np.where(np.isin(range(N), GAP), np.nan, Y)}),
        options={"sampling_time": 0.5},
        missing=True,
    ),
    Messy(
        "matlab_complex.mat",
        lambda p: savemat(p, {"u": U, "y": Y * 1j}),
        options={"sampling_time": 0.5},
        refused=("complex",),
    ),
    Messy("numpy.npz", lambda p: np.savez(p, time=0.5 * np.arange(N), u=U, y=Y)),
    Messy(
        "numpy_short.npz", lambda p: np.savez(p, time=0.5 * np.arange(N), u=U[:5], y=Y), refused=("'u' has 5 samples",)
    ),
    Messy("frame_datetime_index.pkl", lambda p: frame_of().set_index(STAMPS).to_pickle(p)),
    Messy("frame_zone_column.pkl", lambda p: frame_of(when=STAMPS.tz_convert("Asia/Kolkata")).to_pickle(p)),
    Messy(
        "frame_nullable.pkl",
        lambda p: frame_of(
            y=pd.array([v if k not in GAP else None for k, v in enumerate(Y)], "Float64"), time=0.5 * np.arange(N)
        ).to_pickle(p),
        missing=True,
    ),
]


def write_all(folder: Path) -> None:
    for one in FILES:
        one.write(folder)


if __name__ == "__main__":
    write_all(Path(sys.argv[1]))
