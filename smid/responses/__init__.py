"""Responses of a model with certified bands over the feasible set.

Three steps, one file each:

- :mod:`smid.responses.outer_set` bounds linear functions of the parameters over the feasible set, which gives a
  certified polytope around it;
- :mod:`smid.responses.bounding` bounds a response over this polytope;
- :mod:`smid.responses.certified` chooses the directions of the polytope that the responses need.
"""
