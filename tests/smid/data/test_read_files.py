import numpy as np
import pandas
import pytest
from scipy.io import savemat

from smid.data import DataError, Dataset

ROWS = "0.0,1,2\n0.1,3,4\n0.2,5,7\n"


@pytest.fixture
def write(tmp_path):
    def write(text, name="run.csv", encoding="utf-8"):
        path = tmp_path / name
        path.write_bytes(text.encode(encoding))
        return path

    return write


@pytest.mark.parametrize(
    "text",
    [
        "time,u [A],y (bar)\n" + ROWS,
        "# made by hand\n\n#second\ntime;u[A];y(bar)\n0,0;1;2\n0,1;3;4\n0,2;5;7\n",
        "time\tu [A]\ty (bar)\t\n0.0\t1\t2\t\n0.1\t3\t4\t\n0.2\t5\t7\t\n",
        "  time u [A]   y (bar)\r\n 0.0   1 2\r\n 0.1  3  4\r\n\r\n 0.2 5 7",
        '\ufeff"time","u [A]","y (bar)",\n0.0,1,2,\n0.1,3,4,\n0.2,5,7,\n',
    ],
    ids=[
        "comma",
        "semicolon, decimal comma, comments",
        "tabs at line ends",
        "blanks, CRLF",
        "quotes, BOM, end comma",
    ],
)
def test_layouts_of_the_same_data(write, text):
    data = Dataset.from_file(write(text), input="u", output="y")
    assert data.names == ("u", "y")
    assert [channel.unit for channel in data.channels] == ["A", "bar"]
    assert data.sampling_time == 0.1
    assert data.values("u").tolist() == [1, 3, 5]
    assert data.values("y").tolist() == [2, 4, 7]
    assert [record.method for record in data.resampling] == ["none"]


def test_no_header_columns_by_number(write):
    data = Dataset.from_file(write(ROWS), input=1, output="2", time="0", units={"1": "V"})
    assert data.names == ("1", "2")
    assert data.channel("1").unit == "V"


def test_other_columns_are_kept_and_text_columns_left_out_with_a_note(write):
    path = write("u,T,y,comment,Ts\n1,20,2,start,4\n2,21,3,,\n")
    data = Dataset.from_file(path, "u", "y", sampling_time=4)
    assert data.names == ("u", "y", "T")
    assert data.source == "run.csv (left out: comment, Ts)"
    assert Dataset.from_file(path, "u", "y", sampling_time=4, others=()).names == ("u", "y")
    with pytest.raises(DataError, match=r"1 of 2 samples .* are missing, first 'Ts' at sample 1 \(t = 4 s\)"):
        Dataset.from_file(path, "u", "y", sampling_time=4, others="Ts")


def test_names_with_their_unit_are_understood(write):
    data = Dataset.from_file(write("time,u,y [bar]\n" + ROWS), input="u", output="y [bar]")
    assert data.output == "y"


def test_several_files_become_experiments(write):
    text = "u,y\n1,2\n3,4\n"
    data = Dataset.from_file([write(text, "first.csv"), write(text, "second.csv")], "u", "y", sampling_time=1)
    assert [run.name for run in data.experiments] == ["first", "second"]
    with pytest.raises(DataError, match="at least one path"):
        Dataset.from_file([], "u", "y", sampling_time=1)


def test_files_of_different_sampling_time_need_one_that_is_asked_for(write):
    paths = [write("time,u,y\n" + ROWS, "a.csv"), write("time,u,y\n0,1,2\n0.2,3,4\n0.4,5,6\n", "b.csv")]
    with pytest.raises(DataError, match=r"a 0.1 s, b 0.2 s"):
        Dataset.from_file(paths, "u", "y")
    data = Dataset.from_file(paths, "u", "y", sampling_time=0.1)
    assert [record.method for record in data.resampling] == ["none", "linear"]
    assert data.values("u", 1).tolist() == pytest.approx([1, 2, 3, 4, 5])


def test_time_in_milliseconds_from_header_or_argument(write):
    in_header = write("time [ms],u,y\n100,1,2\n110,3,4\n120,5,7\n")
    data = Dataset.from_file(in_header, "u", "y")
    assert data.sampling_time == 0.01
    assert data.experiments[0].start_time == pytest.approx(0.1)
    in_argument = write("t,u,y\n100,1,2\n110,3,4\n120,5,7\n")
    assert Dataset.from_file(in_argument, "u", "y", time="t", units={"t": "ms"}).sampling_time == 0.01
    with pytest.raises(DataError, match="time unit 'fortnight' is not known"):
        Dataset.from_file(in_argument, "u", "y", time="t", units={"t": "fortnight"})


@pytest.mark.parametrize(
    ("text", "arguments", "message"),
    [
        (
            "u,y\n1,2\n3,abc\n",
            {"sampling_time": 1},
            r"run.csv: row 2 \(line 3\), column 'y': 'abc' is not a number",
        ),
        ("#c\nu,y\n1,2\n\n,3\n", {"sampling_time": 1}, r"1 of 2 samples .* are missing, first 'u' at sample 1"),
        ("u,y\n1,\n3,\n", {"sampling_time": 1}, "every sample of 'y' is missing in experiment 'run'"),
        (
            "u,y\n1,2\nnan,3\n",
            {"sampling_time": 1},
            r"1 of 2 samples of experiment 'run' are missing, first 'u' at sample 1 \(t = 1 s\)",
        ),
        (
            "time,u,y\n0,1,2\n1,inf,3\n3,4,5\n",
            {},
            r"channel 'u' of experiment 'run' is inf at sample 1 \(t = 1 s\)",
        ),
        ("u,y\n1,2\n", {}, "neither a column of time stamps nor a sampling time"),
        ("u,yy\n1,2\n", {"sampling_time": 1}, "no column 'y'; did you mean 'yy'"),
        ("u,y\n1,2\n", {"sampling_time": 0}, "not positive"),
        ("u,y\n1,2\n", {"sampling_time": 1, "units": {"z": "V"}}, "no column 'z'"),
        ("u,y\n1,2\n", {"time": "stamp"}, "no column 'stamp'"),
        ("u,y\n1,2\n", {"sampling_time": 1, "delimiter": "::"}, "not one character"),
        ("u,u,y\n1,2,3\n", {"sampling_time": 1}, "two columns are named 'u'"),
        ("u,y\n1,2,3\n", {"sampling_time": 1}, "line 2 has 3 cells but the first row has 2"),
        ("u,y\n", {"sampling_time": 1}, "no row of numbers"),
        ("# nothing\n", {"sampling_time": 1}, "no rows"),
        ("time,u,y\n0,1,2\n2,1,2\n1,3,4\n", {}, r"row 3 \(1 s\) lies before that of row 2 \(2 s\); sort"),
        ("time,u,y\n0,1,2\n2,1,2\n2,3,4\n", {}, "row 3 repeats the time stamp 2 s of row 2"),
        ("time,u,y\n0,1,2\n", {}, "at least two rows"),
        ("time,u,y\n0,1,2\nnan,1,2\n", {}, "time stamp of row 2 is not finite"),
        ("time,u,y\n" + ROWS, {"sampling_time": 5}, "longer than the record"),
        ("time,u,y\n" + ROWS, {"sampling_time": -5}, "not positive"),
        ('u,y\n"1\n",2\n', {"sampling_time": 1}, "spans several lines"),
    ],
)
def test_bad_files_are_refused_with_the_place(write, text, arguments, message):
    with pytest.raises(DataError, match=message):
        Dataset.from_file(write(text), input="u", output="y", **arguments)


def test_missing_file(tmp_path):
    for suffix in ("", ".csv", ".npz", ".mat"):
        with pytest.raises(DataError, match="no file"):
            Dataset.from_file(tmp_path / f"absent{suffix}", input="u", output="y", sampling_time=1)


def test_a_file_beyond_the_memory_is_refused_before_it_is_read(tmp_path):
    file = tmp_path / "year.csv"
    with file.open("wb") as opened:
        opened.truncate(1 << 42)  # takes no space on the disk
    with pytest.raises(DataError, match=r"year.csv has 4.4e\+03 GB, .* this machine has .* parts of the file"):
        Dataset.from_file(file, input="u", output="y", sampling_time=1)


def test_latin_1_header(write):
    data = Dataset.from_file(write("u,y [µm]\n1,2\n", encoding="latin-1"), "u", "y", sampling_time=1)
    assert data.channel("y").unit == "µm"


def test_regular_and_jittered_stamps_of_a_straight_line(write):
    t = np.array([0.0, 0.9, 2.1, 3.0, 4.0])
    text = "time,u,y\n" + "".join(f"{x},{2 * x + 1},{-x}\n" for x in t)
    data = Dataset.from_file(write(text), "u", "y")
    (record,) = data.resampling
    assert (record.method, record.n_original) == ("linear", 5)
    assert record.mean_interval == pytest.approx(1.0)
    assert record.jitter_max == pytest.approx(np.max(np.abs(np.diff(t) - np.median(np.diff(t)))))
    assert data.sampling_time == pytest.approx(np.median(np.diff(t)))
    np.testing.assert_allclose(data.values("u"), 2 * data.time() + 1)
    assert record.curvature_error["u"] == pytest.approx(0, abs=1e-12)


def test_npz(tmp_path):
    path = tmp_path / "run.npz"
    np.savez(
        path,
        time=np.arange(5) * 0.1,
        u=np.arange(10.0).reshape(5, 2),
        y=np.arange(5),
        Ts=0.1,
        other=np.ones(3),
    )
    data = Dataset.from_file(path, input=["u0", "u1"], output="y")
    assert data.names == ("u0", "u1", "y")
    assert data.values("u1").tolist() == [1, 3, 5, 7, 9]
    assert data.sampling_time == 0.1
    assert "left out: other" in data.source
    with pytest.raises(DataError, match="'other' has 3 samples but there are 5 stamps"):
        Dataset.from_file(path, input="y", output="other", sampling_time=1)


def test_npz_refuses_pickles_and_other_files(tmp_path, write):
    path = tmp_path / "objects.npz"
    np.savez(path, u=np.array([{}], dtype=object))
    for bad in (path, write("u,y\n1,2\n", "text.npz"), write("PK\x03\x04 no archive", "broken.npz")):
        with pytest.raises(DataError, match="not an archive of plain arrays"):
            Dataset.from_file(bad, "u", "y", sampling_time=1)


def test_mat(tmp_path, write):
    path = tmp_path / "run.mat"
    savemat(path, {"u": np.arange(4.0), "y": np.arange(4.0)[:, None], "Ts": 0.5, "name": "text", "s": {"a": 1}})
    data = Dataset.from_file(path, input="u", output="y", sampling_time=0.5)
    assert data.values("y").tolist() == [0, 1, 2, 3]
    savemat(path, {"u": np.arange(4) * 1j, "y": np.arange(4)})
    with pytest.raises(DataError, match="complex128 values"):
        Dataset.from_file(path, input="u", output="y", sampling_time=0.5)
    with pytest.raises(DataError, match="cannot be read as a MATLAB file"):
        Dataset.from_file(write("no matlab", "text.mat"), input="u", output="y", sampling_time=0.5)
    v73 = tmp_path / "v73.mat"
    v73.write_bytes(b"MATLAB 7.3 MAT-file".ljust(124) + b"\x00\x02IM" + b"\x89HDF\r\n\x1a\n")
    with pytest.raises(DataError, match="'-v7'"):
        Dataset.from_file(v73, input="u", output="y", sampling_time=0.5)


def test_pandas_frames():
    frame = pandas.DataFrame({"u [A]": [1, 2, 3], "y": [1.0, 2.0, 4.0], "note": ["a", "b", "c"]})
    data = Dataset.from_pandas(frame, "u", "y", sampling_time=0.1)
    assert data.names == ("u", "y")
    assert data.channel("u").unit == "A"
    dates = frame.assign(time=pandas.to_datetime(["2024-01-01 00:00:00", "2024-01-01 00:00:02", "2024-01-01 00:00:04"]))
    assert Dataset.from_pandas(dates, "u", "y").sampling_time == 2.0
    assert Dataset.from_pandas(frame.assign(y=[1, None, 3]), "u", "y", sampling_time=1).missing == {"u": 0, "y": 1}
    with pytest.raises(DataError, match="missing, first 'u' at sample 1"):
        Dataset.from_pandas(frame.assign(**{"u [A]": [1, None, 3]}), "u", "y", sampling_time=1)
    with pytest.raises(DataError, match="convert it to real numbers"):
        Dataset.from_pandas(frame, "u", "note", sampling_time=1)
    with pytest.raises(DataError, match="several levels"):
        Dataset.from_pandas(frame.set_index(["u [A]", "y"]), "u", "y", sampling_time=1)


@pytest.mark.parametrize(
    "text",
    [
        "t\tu\ty\n1,000\t0\t5,950\n2,000\t1\t5.5\n3,000\t0\t1,234,567.5\n",
        't,u,y\n"1,000",0,5950\n"2,000",1,5.5\n"3,000",0,"1,234,567.5"\n',
        "t;u;y\n1.000;0;5.950\n2.000;1;5,5\n3.000;0;1.234.567,5\n",
    ],
    ids=["tabs", "quoted", "points between groups"],
)
def test_thousands(write, text):
    data = Dataset.from_file(write(text), "u", "y", time="t")
    assert data.sampling_time == 1000
    assert data.values("y").tolist() == [5950, 5.5, 1234567.5]


def test_a_comma_that_may_mean_either_is_asked(write):
    path = write("t\tu\ty\n1,000\t0\t5,950\n2,000\t1\t6,100\n")
    with pytest.raises(DataError, match=r"line 2: '1,000' is one number with a decimal comma and another"):
        Dataset.from_file(path, "u", "y", time="t")
    assert Dataset.from_file(path, "u", "y", time="t", decimal=".").values("y").tolist() == [5950, 6100]
    assert Dataset.from_file(path, "u", "y", time="t", decimal=",").values("y").tolist() == [5.95, 6.1]


def test_decimal_signs_that_contradict_are_refused(write):
    with pytest.raises(DataError, match="does not have the same decimal sign"):
        Dataset.from_file(write("u;y\n1,5;2.25\n2,5;3.5\n"), "u", "y", sampling_time=1)
    with pytest.raises(DataError, match="decimal = 'x'"):
        Dataset.from_file(write("u;y\n1,5;2\n"), "u", "y", sampling_time=1, decimal="x")


def test_utf_16(write):
    data = Dataset.from_file(write("u,y [µm]\n1,2\n", encoding="utf-16"), "u", "y", sampling_time=1)
    assert data.channel("y").unit == "µm"


def test_the_name_of_a_time_column_says_its_unit(write):
    assert Dataset.from_file(write("t_ms,u,y\n0,0,1\n10,1,2\n"), "u", "y", time="t_ms").sampling_time == 0.01


def test_unix_milliseconds_are_no_seconds(write):
    path = write("stamp,u,y\n1700000000000,0,1\n1700000000005,1,2\n")
    with pytest.raises(DataError, match=r"which are no seconds; give their unit in the header, as in 'stamp \[ms\]'"):
        Dataset.from_file(path, "u", "y", time="stamp")
    data = Dataset.from_file(path, "u", "y", time="stamp", units={"stamp": "ms"})
    assert data.sampling_time == pytest.approx(0.005)


def test_the_tag_of_an_instrument_is_no_unit(write):
    data = Dataset.from_file(write("flow (Y-101),y (kPa)\n1,2\n3,4\n"), "flow (Y-101)", "y", sampling_time=1)
    assert [(c.name, c.unit) for c in data.channels] == [("flow (Y-101)", ""), ("y", "kPa")]


@pytest.mark.parametrize("header", ["E1,E2", "-,e3"])
def test_a_name_that_looks_like_an_exponent_is_a_header(write, header):
    first, second = header.split(",")
    assert Dataset.from_file(write(f"{header}\n1,2\n3,4\n"), first, second, sampling_time=1).values(
        second
    ).tolist() == [
        2,
        4,
    ]
