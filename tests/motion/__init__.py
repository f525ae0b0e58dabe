"""Motions, events, samples, peaks, work and derivatives are those of closed forms and SciPy, or say why not."""
