"""The fields of the paper S2 are those of the dynamics, by hand and by rates along motions."""
