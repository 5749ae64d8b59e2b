# ---
# jupyter:
#   jupytext:
#     formats: ipynb,py:percent
#   kernelspec:
#     display_name: Python 3
#     language: python
#     name: python3
# ---

# %% [markdown]
# # Why a solver's answer is not a proof
#
# Each end of an interval is the optimum of a polynomial problem. A relaxation turns this problem into a semidefinite
# program, and a solver returns a number with many digits. This number can be wrong.
#
# On this page, an interval from a solver excludes the parameters that made the data. Two methods without a
# semidefinite solver confirm the error. Then we compute a *certificate*, write it to a file, and check it with an
# independent program.

# %%
# %matplotlib inline
import json
import subprocess
import sys
from fractions import Fraction
from pathlib import Path
from tempfile import mkdtemp

import numpy as np
from matplotlib import pyplot as plt
from scipy.optimize import linprog
from scipy.signal import lfilter

import smid
from relaxations.moments.conic import multipliers
from relaxations.proof.bounding import relax
from relaxations.proof.certificate import certify
from relaxations.proof.certificate_file import write_certificate
from relaxations.proof.proof_steps import Bound
from relaxations.solvers import solve
from smid.data.bundled import load_clutch, true_parameters
from smid.display.style import BLUE, GREEN, INK, ORANGE, RED, style

# %% [markdown]
# ## The problem
#
# We use twenty samples of the simulated clutch ramp, with $|\eta_t| \le 0.3$ bar, and the Hammerstein model that made
# them. Every parameter has finite bounds, so the result does not depend on derived boxes.

# %%
START, STOP, BOUND = 15, 35, 0.3
record, truth = load_clutch("hammerstein_20C_ramp_a"), true_parameters("hammerstein_20C_ramp_a")
data = record.crop(START, STOP)
boxes = {"gamma1": (-0.01, 0.0), "gamma2": (0.0, 0.1), "gamma3": (-0.2, 0.0)}
model = smid.Hammerstein(poles=1, powers=(5, 4, 3), input_scale=0.01, stable=True, bounds=boxes)
feasible = smid.FeasibleSet(model, data, BOUND)
print(feasible)

# %% [markdown]
# ## The interval from the textbook relaxation
#
# We build Lasserre's relaxation of order 2 on the cliques of the equations, and solve it with Clarabel. The solver's
# bound is the cost at its final moments.


# %%
def solver_and_certificate(method, order, sign):
    """Return status, the solver's own number, and what its dual variables prove, for one end of alpha."""
    relaxed = relax(feasible.problem, method, order)
    objective = relaxed.scaling.polynomials(feasible.problem.variable(0, sign))
    cost = np.zeros(relaxed.relaxation.n_moments)
    np.add.at(cost, relaxed.relaxation.moments_of(objective.factors), objective.coefficients.mid)
    solution = solve(relaxed.program, cost)
    dual = multipliers(relaxed.relaxation, relaxed.program, solution.dual)
    proof = certify(relaxed.relaxation, objective, dual)
    return solution.status, sign * float(cost @ solution.moments), sign * proof.bound


lower, upper = (solver_and_certificate("textbook", 2, sign) for sign in (1, -1))
textbook = (lower[1], upper[1])
holds = textbook[0] <= truth["alpha"] <= textbook[1]
print(f"alpha in [{textbook[0]:.6f}, {textbook[1]:.6f}], statuses {lower[0]} and {upper[0]}")
print(f"the pole that made the data, {truth['alpha']}, is {'inside' if holds else 'OUTSIDE'}")

# %% [markdown]
# ## Does the true pole fit the data? Two independent checks
#
# **Exact fractions.** Simulate the true parameters in Python's fractions, from the first sample of the record. No
# value is rounded. If the largest error is within the noise bound, the true parameters fit the samples. An interval
# without the true pole is then wrong.

# %%
alpha, *gammas = (Fraction(str(truth[name])) for name in ("alpha", "gamma1", "gamma2", "gamma3"))
v = [Fraction(value) / 100 for value in record.values("current")]
x = [sum(gamma * power for gamma, power in zip(gammas, (vt**5, vt**4, vt**3), strict=True)) for vt in v]
w = [Fraction(0)]
for t in range(1, STOP):
    w.append(-alpha * w[-1] + (1 + alpha) * x[t - 1])
errors = [abs(Fraction(value) - wt) for value, wt in zip(record.values("pressure")[:STOP], w, strict=True)]
largest = max(errors[START:STOP])
assert largest <= Fraction("0.3")
print(f"largest error of the true parameters: {float(largest):.4f} bar, within {BOUND} bar: exactly")

# %% [markdown]
# **A linear program at each pole.** With the pole fixed, the model is linear in three gammas and the first state. The
# least noise bound at this pole is therefore a linear program with five unknowns. The pole fits the data if the least
# noise bound is at most 0.3 bar. Bisection finds both ends.


# %%
def least_bound(pole):
    """Return the least noise bound at a pole, by HiGHS."""
    u, y = 0.01 * data.values("current"), data.values("pressure")
    columns = [lfilter([0, 1 + pole], [1, pole], u**power) for power in (5, 4, 3)]
    response = np.column_stack([*columns, (-pole) ** np.arange(len(u)), np.zeros(len(u))])
    # Unknowns: gamma1..3, w[0], D; |y - w| <= D.
    response[:, -1] = -1
    above = response * [-1, -1, -1, -1, 1]
    limits = [*boxes.values(), (None, None), (0, None)]
    found = linprog([0, 0, 0, 0, 1], np.vstack([response, above]), np.concatenate([y, -y]), bounds=limits)
    return found.fun


def bisect(possible, impossible):
    """Return the end between a pole that is possible and one that is not."""
    for _ in range(40):
        middle = (possible + impossible) / 2
        possible, impossible = (middle, impossible) if least_bound(middle) <= BOUND else (possible, middle)
    return possible


oracle = bisect(truth["alpha"], -0.75), bisect(truth["alpha"], -0.55)
print(f"linear programs: alpha in [{oracle[0]:.7f}, {oracle[1]:.7f}]")

# %%
poles = np.linspace(-0.69, -0.60, 60)
with style():
    figure, axes = plt.subplots(figsize=(5.6, 2.8), layout="constrained")
    axes.plot(poles, [least_bound(pole) for pole in poles], color=BLUE, label="least noise bound, by linear programs")
    axes.axhline(BOUND, color=INK, linewidth=0.6)
    axes.axvspan(*oracle, color=GREEN, alpha=0.15, label="possible poles")
    axes.axvspan(*textbook, color=RED, alpha=0.35, label="the solver's interval")
    axes.axvline(truth["alpha"], color=ORANGE, linestyle="--", label="the pole that made the data")
    axes.set_xlabel("alpha")
    axes.set_ylabel("bar")
    figure.legend(loc="outside upper center", ncols=2)

# %% [markdown]
# ## Why the solver fails
#
# Every equation puts vectors into the null space of all feasible moment matrices. The feasible set of the
# semidefinite program then has no interior, and interior-point methods do not converge. The last iterate is
# meaningless.
#
# There are two remedies:
#
# - `method="sparse"` reduces the matrices to the face that contains the feasible ones (facial reduction).
# - `method="lift"` needs no such matrices ([next page](03_orders_sparsity_lift.ipynb)).
#
# With both, the solver gets close to the optimum. Its number is still not a proof:

# %%
rows = [("textbook", 2, (lower, upper))]
rows += [(m, d, [solver_and_certificate(m, d, sign) for sign in (1, -1)]) for m, d in (("sparse", 2), ("lift", 1))]
print(f"{'method':10}{'order':>6}  {'the solver says':>26}  {'its dual variables prove':>26}  status of the lower end")
for method, order, ends in rows:
    said, proven = (f"[{ends[0][k]:.8f}, {ends[1][k]:.8f}]" for k in (1, 2))
    print(f"{method:10}{order:6}  {said:>26}  {proven:>26}  {ends[0][0]}")
    assert ends[0][2] <= oracle[0] + 1e-9
    assert ends[1][2] >= oracle[1] - 1e-9
print(f"{'linear programs':16}  [{oracle[0]:.8f}, {oracle[1]:.8f}]")

# %% [markdown]
# Compare the two columns. The number of a solver that converged can lie slightly inside the true interval, and the
# status does not show it. The certified bounds never lie inside the true interval; the code asserts this. Where the
# solver failed, the certified bounds are very wide, but valid. Where it converged, they lose a few units in a late
# digit.
#
# ## What a certificate is
#
# To prove $x^2 - x \ge -\tfrac{1}{4}$, write it as $(x - \tfrac{1}{2})^2 - \tfrac{1}{4}$: a square is not negative. A
# certificate does the same for any polynomial on any set of equations and inequalities. The dual variables of a
# solver give multipliers $\lambda_k$ and matrices $F_j$. For any values of $\lambda_k$ and $F_j$, the polynomial
#
# $$ r = f - \sum_k \lambda_k h_k m_k - \sum_j \langle F_j F_j^{\mathsf T},\; g_j b_j b_j^{\mathsf T} \rangle $$
#
# satisfies $f \ge r$ on the feasible set, where $h_k = 0$ and $g_j \ge 0$. With all variables scaled to $[-1, 1]$, $r
# \ge r_0 - \sum_{i > 0} |r_i|$. An exact solver would make $r$ constant. A less exact solver gives a weaker bound,
# but the bound stays valid. So the solver only supplies a good guess, and the proof is a multiplication. smid
# multiplies in arithmetic that encloses its own rounding errors.
#
# ## A certificate in a file

# %%
folder = Path(mkdtemp())
relaxed = relax(feasible.problem, "lift", 1)
objective = feasible.problem.variable(0)
steps = [Bound.of(relaxed, objective, relaxed.bound(objective))]
write_certificate(folder / "alpha.json", feasible.problem, steps)


def check(file):
    """Run the check as anybody would: with the standard library alone, in exact fractions."""
    command = [sys.executable, "-m", "relaxations.check", file.name]
    run = subprocess.run(command, cwd=folder, capture_output=True, text=True, check=False)
    print((run.stdout + run.stderr).strip(), f"(exit code {run.returncode})")
    return run.returncode


assert check(folder / "alpha.json") == 0

# %% [markdown]
# The file contains the problem with its data, and the multipliers. To accept the result you need to trust only the
# package `relaxations.check`, not smid, the solver or NumPy. The check multiplies everything out again, so it finds
# any change that breaks the proof. First change: a bound that is slightly too good.

# %%
document = json.loads((folder / "alpha.json").read_text(encoding="utf-8"))
print("keys:", ", ".join(document), "| of a step:", ", ".join(document["steps"][0]))


def tampered(change):
    """Check a copy of the certificate in which something was changed."""
    copy = json.loads(json.dumps(document))
    change(copy)
    (folder / "tampered.json").write_text(json.dumps(copy), encoding="utf-8")
    return check(folder / "tampered.json")


def better_bound(copy):
    step = copy["steps"][0]
    step["bound"] = (float.fromhex(step["bound"]) + 1e-6).hex()


assert tampered(better_bound) == 1

# %% [markdown]
# Second change: another problem. One coefficient of the first equation changes by 0.1 %:


# %%
def other_data(copy):
    coefficient = copy["equalities"][0][0]
    coefficient[0] = (1.001 * float.fromhex(coefficient[0])).hex()


assert tampered(other_data) == 1

# %% [markdown]
# (The check does not know your record. `smid verify` compares the problem in the file with your model and your data.)
#
# Third change: a worse multiplier. It still proves a weaker bound, but not the bound that the file claims:


# %%
def other_multiplier(copy):
    factor = copy["steps"][0]["products"][0]["factor"]
    factor[0][0] = (1.01 * float.fromhex(factor[0][0]) + 0.01).hex()


assert tampered(other_multiplier) == 1

# %% [markdown]
# **Try next:** claim a weaker bound in `better_bound`; take other samples in `START, STOP`. [The
# mathematics](../docs/maths.md) explains facial reduction and the other steps. Then: [orders, sparsity, the
# lift](03_orders_sparsity_lift.ipynb).
