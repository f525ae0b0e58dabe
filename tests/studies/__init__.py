"""Stored studies survive kills, other writers and full disks, and their tables have names and units."""
