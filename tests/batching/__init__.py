"""A batch gives each design what it would get alone, failed ones included, in any chunks, on tapes and compiled."""
