"""Polynomial optimization with moment/SOS relaxations whose bounds are proven in rounded arithmetic.

The modules follow the theory: :mod:`~relaxations.polynomial` -> :mod:`~relaxations.problem` ->
:mod:`~relaxations.lift` or :mod:`~relaxations.lasserre` -> :mod:`~relaxations.conic` ->
:mod:`~relaxations.certificate` and :mod:`~relaxations.witness` -> :mod:`~relaxations.hierarchy`.
"""
