"""Bond graphs pass on all power, have the state equations of the dynamics, and are drawn without overlaps."""
