"""Linear systems from arrays and files: faults of matrices are found, and rows without mass are condensed."""
