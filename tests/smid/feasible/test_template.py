"""Templates: exact coefficients, and no symbolic work per sample."""

from fractions import Fraction
from time import process_time

import numpy as np
import pytest
import sympy

from smid import Dataset, FeasibleSet, Hammerstein, ModelError, OutputError, Wiener
from smid.feasible.template import flat_lines, is_polynomial, templates
from smid.models import Line, Measurement, Model, OwnModel, Parameter
from smid.models.symbols import signal, t


def data_of(n: int, seed: int = 0) -> Dataset:
    rng = np.random.default_rng(seed)
    return Dataset.from_arrays(
        input={"u": rng.uniform(0, 900, n)}, output={"y": rng.uniform(-30, 30, n)}, sampling_time=1.0
    )


def coefficients(feasible: FeasibleSet, row: int) -> dict[tuple[str, ...], tuple[Fraction, Fraction]]:
    """Return the exact ends of the ball of each monomial's coefficient."""
    equalities, names = feasible.problem.equalities, feasible.problem.names
    found = {}
    for r, factor, mid, rad in zip(
        equalities.rows.tolist(),
        equalities.factors.tolist(),
        equalities.coefficients.mid.tolist(),
        equalities.coefficients.rad.tolist(),
        strict=True,
    ):
        if r == row:
            monomial = tuple(sorted(names[v] for v in factor if v >= 0))
            found[monomial] = (Fraction(mid) - Fraction(rad), Fraction(mid) + Fraction(rad))
    return found


@pytest.mark.parametrize("scale", [1.0, 0.01, 1 / 3])
def test_balls_contain_the_exact_coefficients(scale: float) -> None:
    data = data_of(12)
    feasible = FeasibleSet(Hammerstein(1, (5, 4, 3), input_scale=scale, stable=True), data, 0.3)
    u, y = ([Fraction(x) for x in data.values(c).tolist()] for c in ("u", "y"))
    for row in range(feasible.n_equalities):
        sample = row + 1
        exact = {
            (): y[sample],
            ("alpha",): y[sample - 1],
            (f"eta[{sample}]",): Fraction(-1),
            ("alpha", f"eta[{sample - 1}]"): Fraction(-1),
        }
        for k, power in enumerate((5, 4, 3), start=1):
            value = -((Fraction(scale) * u[sample - 1]) ** power)
            exact[(f"gamma{k}",)] = exact[("alpha", f"gamma{k}")] = value
        found = coefficients(feasible, row)
        assert set(found) == set(exact)
        for monomial, (low, high) in found.items():
            assert low <= exact[monomial] <= high
            # A ball is a rounding error wide, no more.
            assert high - low <= abs(exact[monomial]) * Fraction(1, 10**13)


def test_balls_contain_the_exact_coefficients_of_a_sum_of_products() -> None:
    """The inverse curve of a Wiener model multiplies samples and binomial factors."""
    data = data_of(9, seed=3)
    feasible = FeasibleSet(Wiener(1, (3,)), data, 0.3)
    y = [Fraction(x) for x in data.values("y").tolist()]
    sensor = feasible.n_equalities - len(y)  # the sensor's equalities follow those of the dynamics
    for k, now in enumerate(y):
        found = coefficients(feasible, sensor + k)
        eta = f"eta[{k}]"
        exact = {
            (f"x[{k}]",): Fraction(1),
            (): -now,
            ("s3",): -(now**3),
            (eta, "s3"): 3 * now**2,
            (eta, eta, "s3"): -3 * now,
            (eta, eta, eta, "s3"): Fraction(1),
        }
        for monomial, value in exact.items():
            low, high = found[tuple(sorted(monomial))]
            assert low <= value <= high


def test_symbolic_work_does_not_grow_with_the_record(monkeypatch: pytest.MonkeyPatch) -> None:
    calls = {"poly": 0, "expand": 0}
    poly, expand = sympy.Poly, sympy.expand

    class CountingPoly(poly):  # type: ignore[misc,valid-type]
        def __new__(cls, *args, **settings):
            calls["poly"] += 1
            return poly(*args, **settings)

    def counting_expand(*args, **settings):
        calls["expand"] += 1
        return expand(*args, **settings)

    monkeypatch.setattr(sympy, "Poly", CountingPoly)
    monkeypatch.setattr(sympy, "expand", counting_expand)
    counted = []
    for n in (20, 400):
        calls.update(poly=0, expand=0)
        feasible = FeasibleSet(Hammerstein(1, (5, 4, 3), stable=True), data_of(n), 0.3)
        assert feasible.n_equalities == n - 1
        counted.append(dict(calls))
    assert counted[0] == counted[1]
    assert counted[0]["poly"] > 0


def test_static_lines_are_substituted_and_dynamic_ones_stay() -> None:
    (template,) = templates(Hammerstein(1, (3,), delay=2, stable=True))
    assert template.signal == "w"
    assert template.max_lag == 2
    assert template.latents == {("eta", 0), ("eta", 1)}
    (line,) = flat_lines(Hammerstein(1, (3,), input_scale=2, stable=True))
    alpha, gamma = sympy.symbols("alpha gamma1", real=True)
    u, w = signal("u"), signal("w")
    assert sympy.expand(line - (w[t] + alpha * w[t - 1] - (1 + alpha) * gamma * 8 * u[t - 1] ** 3)) == 0


def test_an_unmeasured_state_stays_latent() -> None:
    """Two lags in a row, with a square between them; only the second one is measured."""
    a, b = Parameter("a", -1, 1), Parameter("b", -1, 1)
    u, x, w = signal("u"), signal("x"), signal("w")
    model = Model(
        "cascade",
        (a, b),
        (Line(x[t], a.symbol * x[t - 1] + u[t - 1]), Line(w[t], b.symbol * w[t - 1] + x[t - 1] ** 2)),
        (Measurement("y", "w", "eta"),),
    )
    parts = {part.signal: part for part in templates(model)}
    assert parts["x"].latents == {("x", 0), ("x", 1)}
    assert parts["w"].latents == {("x", 1), ("eta", 0), ("eta", 1)}
    feasible = FeasibleSet(model, data_of(10), 0.1)
    assert feasible.n_equalities == 18
    latent = [k for k, name in enumerate(feasible.problem.names) if name.startswith("x[")]
    assert len(latent) == 10
    assert np.isinf(feasible.problem.upper[latent]).all()  # nothing is known of it beforehand


def test_a_quotient_of_exponentials_is_refused_and_does_not_end_python() -> None:
    """A search for common factors of these powers asks for integers that no computer holds."""
    p, u, w = Parameter("p", -6, 6), signal("u"), signal("w")
    shares = [sympy.exp(-sympy.Rational(k, 9007199254740992) * p.symbol) for k in (8256599316845909, 5254199565265579)]
    line = Line(w[t], (shares[0] * u[t - 1] + shares[1] * w[t - 1]) / (shares[0] + shares[1] + 1))
    model = Model("shared", (p,), (line,), (Measurement("y", "w", "eta"),))
    with pytest.raises(ModelError, match=r"the line of 'w' is not a polynomial"):
        templates(model)
    with pytest.raises(ModelError, match="which is not a fraction"):
        templates(model.fix(p=0.3))


def test_what_is_no_polynomial_is_refused() -> None:
    a = Parameter("a", 0, 1)
    u, w = signal("u"), signal("w")
    model = Model(
        "swinging",
        (a,),
        (Line(w[t], sympy.sin(a.symbol * w[t - 1]) + u[t - 1]),),
        (Measurement("y", "w", "eta"),),
    )
    with pytest.raises(ModelError, match=r"the line of 'w' is not a polynomial.*write it with polynomials"):
        templates(model)


def test_a_float_in_a_model_is_the_binary_fraction_that_it_is() -> None:
    (template,) = templates(OutputError(1, 0, fixed={"b0": 0.1}))
    factors = {factor for term in template.terms for factor, _ in term.data}
    assert -Fraction(0.1) in factors


def test_a_line_of_too_many_terms_is_not_written_out():
    """Four stages of Runge and Kutta with a drag: sympy takes a minute to multiply them out."""
    boxes = {"theta": (2, 200), "d": (0.01, 10), "k": (0, 16)}
    model = OwnModel(
        ["d/dt w = theta*(u - d*w) - k*Abs(w)*w"], {"y": "w"}, ["u"], boxes, scheme="rk4", sampling_time=0.02
    )
    began = process_time()
    assert not is_polynomial(model)
    assert process_time() - began < 10
    with pytest.raises(ModelError, match=r"a line of the model has more than 20000 terms .* give method='inversion'"):
        templates(model)
