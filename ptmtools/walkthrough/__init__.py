"""The walk of a visitor, and what streaming a database shows him on it."""
