"""The check of an installation names what is faulty, and what to do about it."""
