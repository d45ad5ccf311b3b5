"""Periodic motions: shooting, harmonic balance, multipliers, and what is read off a motion."""
