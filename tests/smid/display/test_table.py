"""Text tables: columns line up, and rows fit their header."""

from xml.etree import ElementTree

import pytest

from smid.display.table import Table


def test_columns_line_up():
    table = Table("Errors.", ("record", "RMSE"), (("a", "10.5"), ("longer", "2")), "lr")
    lines = str(table).splitlines()
    assert lines == ["Errors.", "record  RMSE", "a       10.5", "longer     2"]
    assert str(Table("", ("x",), (("1",),), "r")).splitlines() == ["x", "1"]


def test_html_escapes_and_keeps_the_sides():
    html = Table("a < b", ("name", "x [<bar>]"), (("<i>", "1"),), "lr")._repr_html_()
    figure = ElementTree.fromstring(html)
    assert [part.tag for part in figure] == ["figcaption", "table"]
    assert figure[0].text == "a < b"
    heads, cells = list(figure.iter("th")), list(figure.iter("td"))
    assert [(head.text, head.get("scope")) for head in heads] == [("name", "col"), ("x [<bar>]", "col")]
    assert [(cell.text, cell.get("style")) for cell in cells] == [
        ("<i>", "text-align: left"),
        ("1", "text-align: right"),
    ]
    assert ElementTree.fromstring(Table("", ("x",), (), "r")._repr_html_())[0].tag == "table"


@pytest.mark.parametrize(("rows", "align"), [((("a",),), "lr"), ((("a", "b"),), "l")])
def test_rows_that_do_not_fit_are_refused(rows, align):
    with pytest.raises(ValueError, match="does not fit the header"):
        Table("", ("record", "RMSE"), rows, align)
