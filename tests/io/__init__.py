"""Files go out and come in again, agree with other readers, and spoilt ones have an error by their line."""
