"""The stages from a model to the served files: their table, their cache, and their runs."""
