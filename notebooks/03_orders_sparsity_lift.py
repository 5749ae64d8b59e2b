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
# # Orders, sparsity, the lift
#
# A relaxation turns a polynomial problem into a convex problem in *moments*, one number for each monomial. The order
# sets the highest degree of the monomials. A higher order gives a tighter bound and costs much more.
#
# This page shows how to choose. It starts with the package `relaxations` alone, on two problems of a collection. Then
# it treats an identification problem, whose structure makes the same bound much cheaper.

# %%
# %matplotlib inline
import time
from math import comb
from textwrap import fill

import numpy as np
from matplotlib import pyplot as plt

import smid
from relaxations import library
from relaxations.errors import ProblemError
from relaxations.formats.expressions import minimise, variables
from relaxations.proof.bounding import relax
from relaxations.search import minimise as minimise_problem
from smid.display.style import INK, style

# %% [markdown]
# ## A bound and a point
#
# Minimise a linear function on a polytope from which a concave quadratic constraint removes a piece. The problem is
# GLOBALLib's ex3_1_4, by Floudas and Pardalos. A local search can end in either of two corners. We want a point, and
# a proof that no other point is better.

# %%
x1, x2, x3 = variables("x1 x2 x3")
cut = 4 * x1**2 - 4 * x1 * x2 + 4 * x1 * x3 + 2 * x2**2 - 2 * x2 * x3 + 2 * x3**2 - 20 * x1 + 9 * x2 - 13 * x3 + 24
polytope = [x1 + x2 + x3 <= 4, 3 * x2 + x3 <= 6, x1 >= 0, x1 <= 2, x2 >= 0, x2 <= 2, x3 >= 0, x3 <= 3]
print(minimise(-2 * x1 + x2 - x3, [cut >= 0, *polytope]))

# %% [markdown]
# ## What a higher order gives
#
# `minimise` raised the order until the bound met a feasible point. Here we do it order by order, for this problem and
# for a problem with eight variables (a network of heat exchangers, Floudas 3.2). Both are in `relaxations.library`,
# with their known optima. Every bound is certified.


# %%
def bounded(case, order, method="sparse"):
    """Return the relaxation, its certified bound, and the seconds that both took."""
    begun = time.process_time()
    relaxed = relax(case.problem, method, order, objective=case.objective)
    bound = relaxed.bound(case.objective).bound
    return relaxed.relaxation, bound, time.process_time() - begun


studies = {}
for name, orders in (("gms_Bex3_1_4", (1, 2, 3, 4)), ("floudas_3_2", (1, 2, 3))):
    case = library.load(name)
    print(f"{name}: {case.problem.n_variables} variables, known optimum {case.optimum:.7g}")
    studies[name] = case, []
    for order in orders:
        relaxation, bound, seconds = bounded(case, order)
        studies[name][1].append((order, bound))
        print(
            f"  order {order}: {relaxation.n_moments:4} moments, widest matrix {relaxation.largest_block:3}, "
            f"bound {bound:.8g}, {seconds:.2f} s"
        )
        assert bound <= case.optimum + 1e-6 * abs(case.optimum)

# %%
with style():
    figure, panels = plt.subplots(1, 2, figsize=(5.6, 2.3), layout="constrained")
    for axes, (name, (case, points)) in zip(panels, studies.items(), strict=True):
        axes.axhline(case.optimum, color=INK, linewidth=0.6, label="optimum")
        axes.plot(*zip(*points, strict=True), "o-", markersize=4, label="certified bound")
        axes.set_xticks([order for order, _ in points])
        axes.set_xlabel("order")
        axes.set_title(name, loc="left")
    panels[0].legend()

# %% [markdown]
# Each order is at least as tight as the previous one, up to the solver's accuracy, which the certificate deducts.
# Often a low order is nearly exact; here it is order 3. The necessary order is not known in advance. The order is
# sufficient when the bound meets a verified point.
#
# ## What an order costs
#
# With $n$ variables and order $d$ there are $\binom{n + 2d}{2d}$ moments, in a matrix of width $\binom{n + d}{d}$.
# Matrices wider than about forty are slow. Matrices wider than a few hundred are impractical:

# %%
print("variables" + "".join(f"{f'order {d}: width':>17}{'moments':>11}" for d in (1, 2, 3)))
for n in (2, 4, 8, 16, 32, 64):
    print(f"{n:9}" + "".join(f"{comb(n + d, d):17}{comb(n + 2 * d, 2 * d):11}" for d in (1, 2, 3)))

# %% [markdown]
# ## An identification problem
#
# Take $N$ samples of a plant with one pole, $w_t = -a_1 w_{t-1} + b_0 u_{t-1}$, $y_t = w_t + \eta_t$. The unknowns
# are two parameters and one noise for each sample. The problem has $N + 2$ variables, and order 1 is not tight.


# %%
def identification(n, noise_bound=0.3):
    """Return the feasible set of n samples; the same ones first, whatever n is."""
    u = smid.signals.prbs(64, seed=1)
    w = np.zeros(64)
    for t in range(1, 64):
        w[t] = 0.8 * w[t - 1] + u[t - 1]
    y = w + np.random.default_rng(1).uniform(-noise_bound, noise_bound, 64)
    data = smid.Dataset.from_arrays(input={"u": u[:n]}, output={"y": y[:n]}, sampling_time=1.0)
    return smid.FeasibleSet(smid.OutputError(na=1, stable=True, bounds={"b0": (0, 3)}), data, noise_bound)


feasible = identification(16)
print(feasible)
print(*(f"0 = {equality}" for equality in feasible.to_sympy()["equalities"][:2]), sep="\n")

# %% [markdown]
# ## Sparsity
#
# Each equation contains the two parameters and two neighbouring noises. A dark square below marks two variables that
# share an equation. This graph splits into *cliques*, here one for each equation. Several small moment matrices, one
# for each clique, replace the large one. Variables that share no equation share no moments.

# %%
names, cliques = feasible.problem.names, feasible.cliques()
print(f"{len(cliques)} cliques of at most {max(map(len, cliques))} variables: {cliques[0]}, {cliques[1]}, ...")
share = np.zeros((len(names), len(names)))
for clique in cliques:
    members = [names.index(name) for name in clique]
    share[np.ix_(members, members)] = 1
with style():
    figure, axes = plt.subplots(figsize=(3.6, 3.6), layout="constrained")
    axes.pcolormesh(share, cmap="Blues", vmax=1.4, edgecolors="white", linewidth=0.5)
    axes.set_xticks(np.arange(len(names)) + 0.5, names, rotation=90)
    axes.set_yticks(np.arange(len(names)) + 0.5, names)
    axes.invert_yaxis()
    axes.set_aspect("equal")

# %% [markdown]
# ## The lift
#
# The equations have more structure than sparsity. With $a_1$ fixed, all other variables enter linearly. So the lift
# needs only moments of powers of $a_1$, and their products with one other variable. It needs no products of noises.
# smid finds the *complicating* variables, which must be fixed, automatically: they are a smallest set that covers
# every product.

# %%
print("complicating:", feasible.complicating)
target = feasible.problem.variable(0)  # the lower end of a1
witness = smid.identify(feasible.model, feasible.data, 0.3)["a1"].inner_lower
print(f"method    order  moments  widest        bound   (a verified point has a1 = {witness:.6f})")
for method, order in (("dense", 1), ("sparse", 1), ("sparse", 2), ("lift", 1), ("lift", 2)):
    relaxed = relax(feasible.problem, method, order)
    bound = relaxed.bound(target).bound
    assert bound <= witness
    sizes = f"{relaxed.relaxation.n_moments:7}  {relaxed.relaxation.largest_block:6}"
    print(f"{method:8}  {order:5}  {sizes}   {bound:.8f}")

# %% [markdown]
# Dense and sparse relaxations of order 1 give the same bound, which is not tight. The sparse relaxation of order 2
# meets the verified point; a dense one would need a matrix of width 190. The lift meets the point at order 1, with
# fewer moments than any other method. Cost against the length of the record:

# %%
ways = (("dense", 1), ("sparse", 1), ("sparse", 2), ("lift", 1), ("lift", 2))
costs = {way: [] for way in ways}
for n in (8, 16, 32, 64):
    problem = identification(n).problem
    for method, order in ways:
        if n > 32 and (method, order) in (("dense", 1), ("sparse", 2)):
            continue  # too slow for a page
        begun = time.process_time()
        relaxed = relax(problem, method, order)
        relaxed.bound(problem.variable(0))
        costs[method, order].append((n, relaxed.relaxation.n_moments, time.process_time() - begun))
with style():
    figure, panels = plt.subplots(1, 2, figsize=(5.6, 2.6), layout="constrained")
    for (method, order), found in costs.items():
        samples, moments, seconds = zip(*found, strict=True)
        panels[0].loglog(samples, moments, "o-", markersize=3, label=f"{method}, order {order}")
        panels[1].loglog(samples, seconds, "o-", markersize=3)
    for axes, title in zip(panels, ("moments", "seconds for a bound"), strict=True):
        axes.set_title(title, loc="left")
        axes.set_xlabel("samples")
        axes.set_xticks((8, 16, 32, 64), ("8", "16", "32", "64"))
        axes.minorticks_off()
    figure.legend(loc="outside upper center", ncols=3)

# %% [markdown]
# smid refuses a relaxation that exceeds the memory of the machine, before it starts:

# %%
try:
    relax(identification(64).problem, "dense", 2)
except ProblemError as error:
    print(fill(str(error), 110))

# %% [markdown]
# ## When an order is not tight
#
# A higher order is the most expensive way to close a gap. Two ways are cheaper:
#
# - **Contract**: a certified interval is a smaller box, and the same relaxation is tighter on a smaller box.
# - **Branch**: split the box and bound the parts.
#
# `minimise` and `smid.identify` do both automatically. Here is branching with order 1 only, on the first problem:

# %%
case = library.load("gms_Bex3_1_4")
print(minimise_problem(case.problem, case.objective, order=1, nodes=0))
print(minimise_problem(case.problem, case.objective, order=1, nodes=400))

# %% [markdown]
# **Try next:** `library.names()` lists a hundred problems. `motzkin` has no certificate at any order, and
# `waki_strange` makes solvers report wrong bounds. `smid.order_study` compares orders on your record ([a study on a
# cluster](12_study_on_a_cluster.ipynb)). Then: [errors in variables](04_errors_in_variables.ipynb).
