"""Reduced components have the whole one's modes, statics and loads, within the errors that they state."""
