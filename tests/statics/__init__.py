"""Reactions in networks of bodies are those of S1's matrix and closed forms, with two orders of derivatives."""
