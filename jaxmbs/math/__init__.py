"""Pure functions on arrays: rotations, spatial vectors, tensor products."""
