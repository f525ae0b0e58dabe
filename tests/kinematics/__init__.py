"""The passes over the tree are plain sums along paths, with derivatives."""
