"""Published reference cases, each built as a user would build it and compared with numbers made elsewhere."""
