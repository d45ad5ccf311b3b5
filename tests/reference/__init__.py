"""Independent routes to the motions of a machine with clearances: no kernel of flipflow is used.

The reference values of the FFS0827 to which tests hold flipflow come from two programs outside it:
matrix exponentials piece by piece with Newton's method on the switching times, and DOP853 with
located events at rtol 1e-11 over 70 periods and more. The two agree to 1e-13 m, and harmonic
balance with 31 harmonics was the cross-check.
"""
