"""Universal files of others are read in every form, and ours by pyuff; spoilt ones have worded errors."""
