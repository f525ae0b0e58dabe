"""Tests of jaxmbs: a folder for each room, which says in its first lines what it proves."""
