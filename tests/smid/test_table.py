"""Text tables: columns line up, and rows fit their header."""

import pytest

from smid.table import Table


def test_columns_line_up():
    table = Table("Errors.", ("record", "RMSE"), (("a", "10.5"), ("longer", "2")), "lr")
    lines = str(table).splitlines()
    assert lines == ["Errors.", "record  RMSE", "a       10.5", "longer     2"]
    assert str(Table("", ("x",), (("1",),), "r")).splitlines() == ["x", "1"]


@pytest.mark.parametrize(("rows", "align"), [((("a",),), "lr"), ((("a", "b"),), "l")])
def test_rows_that_do_not_fit_are_refused(rows, align):
    with pytest.raises(ValueError, match="does not fit the header"):
        Table("", ("record", "RMSE"), rows, align)
