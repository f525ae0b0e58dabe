"""Searches find minima that are known, with limits, many starts and two aims, and say where they did not."""
