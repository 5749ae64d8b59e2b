"""Generalised Benders decomposition: bounds where few variables complicate, from linear programs at fixed values.

Let ``p`` be the complicating variables and ``z`` the others, in which every constraint is affine::

    h(p, z) = 0,   g(p, z) >= 0,   |z_t| <= 1 (scaled).

For any multipliers lambda and nu >= 0 a feasible point satisfies ``lambda'h + nu'g >= 0``. The left side is
``c_0(p) + sum_t c_t(p) z_t``, so without z::

    c_0(p) + sum_t |c_t(p)| >= 0,

the *cut* of these multipliers, true for all p of the set and with exact data a theorem whatever solver found them. The
dual of the linear program at a fixed p that is not feasible gives the cut that misses it most (:mod:`.program`). On a
box of p every ``|c_t|`` lies below its chord, which leaves a linear inequality (:mod:`.cuts`) that is exact for all t
whose c_t keeps its sign. A search for good points in the space of p (:mod:`.search`) meets the cuts that matter, and
branch and bound in that space (:mod:`.tree`) proves the ends. Its programs have as many unknowns as there are
complicating variables, however long the record.

References
----------
A. M. Geoffrion, "Generalized Benders decomposition", Journal of Optimization Theory and Applications 10 (1972) 237-260.
C. A. Floudas and V. Visweswaran, "A global optimization algorithm (GOP) for certain classes of nonconvex NLPs",
Computers & Chemical Engineering 14 (1990) 1397-1417.
"""
