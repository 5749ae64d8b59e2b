"""Sets by inversion of the free run: for any model that can be simulated, polynomial or not.

Where the noise is at the outputs, the unknowns are few: the parameters, and the initial samples of the states. Over a
box of these a free run is enclosed in affine arithmetic, so each sample states a linear inequality with a small radius.
Linear programs contract the box, and their multipliers prove it. Boxes that reach beyond verified points are cut. This
gives certified intervals, or the proof that the set is empty. Where measurements show each state of a differential
equation or its integral, the box is narrowed without a free run before.

From the bottom: :mod:`.operations`, :mod:`.phi`, :mod:`.stages`, :mod:`.step_box`, :mod:`.integration` and
:mod:`.both_ends` (rates between two samples), :mod:`.free_run` (the enclosures along a record), :mod:`.rates` and
:mod:`.tape` (a model as a list of operations), :mod:`.pieces` (a record in parts, where states are hidden),
:mod:`.record` (the rows of a box, and verified points), :mod:`.contraction`, :mod:`.terms`, :mod:`.comparison`,
:mod:`.integrals` and :mod:`.narrowing` (without a free run), :mod:`.outermost` (points near the ends),
:mod:`.cover` (the boxes), :mod:`.inverted` (the intervals).
"""
