"""Pictures show what is there, with all text legible, and open no window."""
