"""Every law has the force of its formula, keeps its energy, and has right slopes on every port it can have."""
