"""Scenes are one file with the motion's own numbers, and run in a browser."""
