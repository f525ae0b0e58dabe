"""Joined components are the structure that they were cut from: modes, loads of bonds, balance, redundancy."""
