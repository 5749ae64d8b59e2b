"""Polynomial optimization with moment/SOS relaxations whose bounds are proven in rounded arithmetic.

The modules follow the theory: :mod:`~relaxations.polynomial` -> :mod:`~relaxations.problem` ->
:mod:`~relaxations.lift` or :mod:`~relaxations.lasserre` -> :mod:`~relaxations.conic` ->
:mod:`~relaxations.certificate` and :mod:`~relaxations.witness` -> :mod:`~relaxations.hierarchy`.

Problems come from :mod:`~relaxations.formats` (operators, text, GAMS, JSON, SDPA) and :mod:`~relaxations.library`
(named problems with known optima). :mod:`~relaxations.certificate_file` writes certificates, and ``python -m
relaxations.check FILE`` checks them. Nothing is imported here, for the check must stand without the rest.
"""
