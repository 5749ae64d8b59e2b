"""Polynomial optimization with moment/SOS relaxations whose bounds are proven in rounded arithmetic.

The modules follow the theory: :mod:`~relaxations.algebra.polynomial` -> :mod:`~relaxations.problem.problem` ->
:mod:`~relaxations.moments.parametric_lift` or :mod:`~relaxations.moments.lasserre_hierarchy` ->
:mod:`~relaxations.moments.conic` -> :mod:`~relaxations.proof.certificate` and :mod:`~relaxations.points.witness` ->
:mod:`~relaxations.search.hierarchy`.

Problems come from :mod:`~relaxations.formats` (operators, text, GAMS, JSON, SDPA) and :mod:`~relaxations.library`
(named problems with known optima). :mod:`~relaxations.proof.certificate_file` writes certificates, and ``python -m
relaxations.check FILE`` checks them. This module imports nothing, so that the check loads no other module.
"""
