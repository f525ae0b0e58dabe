"""Wrong use of every public name is refused in words before anything is traced, or shows in the result."""
