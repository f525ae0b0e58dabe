"""Substructures: components reduced to their interfaces, coupled, and the reactions between them."""

from .interface import Components, CoupledResponse, couple, interface_pattern
