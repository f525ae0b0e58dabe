"""Elements of circuits have the flows of their formulas, and lose no oil and no power."""
