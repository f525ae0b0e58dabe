"""The questions that take either noun, a mechanism (`System`) or a linear system (`LinearSystem`)."""

from .either import check, equilibrium, frequency_response, modes, reactions, simulate

__all__ = ["check", "equilibrium", "frequency_response", "modes", "reactions", "simulate"]
