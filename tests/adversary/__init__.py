"""Random, extreme and hostile models and files: a right answer by an independent judge, or an error in words."""
