"""Standard input data bring back bodies with their mechanics."""
