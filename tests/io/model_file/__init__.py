"""Model files bring back every class bit by bit; wrong changes by hand are refused by their place."""
