"""Every model of friction has the curve of its source in every place that takes it, with its heat and slopes."""
