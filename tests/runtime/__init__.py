"""Programs on tapes, compiled, stored or split give one answer; JAX's inner parts work as the room takes them."""
