"""A move's path: joint positions over a parameter s from 0 to 1, as piecewise Chebyshev polynomials.

`polynomial` is the type, `ptp` and `lin` make one of a move.
"""
