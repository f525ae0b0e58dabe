"""Contacts push, rub and stick by their formulas in every regime, with slopes, and say where their model ends."""
