"""Mechanisms inside of other programs (OpenMDAO, Tesseract, FMI) have the values and slopes that they have here."""
