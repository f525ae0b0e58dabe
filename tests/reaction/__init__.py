"""Reactions balance all loads, by name, side and axis; redundant ones by least compliance, and marked so."""
