"""Compiled code only: gap motion, flow, shooting, harmonic balance, arc length.

Every kernel is a plain scalar function with its scratch passed in, compiled by
:func:`flipflow.kernels.compile.kernel` and by nothing else.
"""
