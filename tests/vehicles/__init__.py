"""Tyres against published programs and closed forms, at rest and rolling; roads."""
