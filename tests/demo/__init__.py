"""The demo and README's example run from beginning to end."""
