"""Exported FMUs hold to FMI's schema, run in fmpy and in a host written in C, and give the numbers of `simulate`."""
