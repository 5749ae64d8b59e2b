"""Boxes of a certificate of runs with any multipliers, of which hardly any prove something."""

from hypothesis import strategies as st


def any_boxes(row):
    """Draw the halves of a box of three unknowns, each with a few contractions by four rows.

    Parameters
    ----------
    row
        Draws the source of a row.
    """
    rows = st.lists(row.map(list), min_size=4, max_size=4)
    terms = st.lists(st.tuples(st.integers(0, 3), st.integers(-200, 200)), max_size=4)
    side = st.tuples(
        st.sampled_from([0, 1, 2] * 4 + [None]),
        st.sampled_from([-1, 1]),
        st.integers(0, 8),
        terms.map(lambda own: [value for pair in own for value in pair]),
    ).map(list)
    half = st.lists(st.fixed_dictionaries({"rows": rows, "sides": st.lists(side, max_size=4)}), max_size=3)
    cut = st.tuples(st.integers(0, 1), st.integers(0, 4)).map(lambda c: [c[0], f"{c[1]}/4"])
    return st.tuples(cut, half, half).map(lambda d: [{"cut": d[0]}, {"passes": d[1]}, {"passes": d[2]}])
