"""Makes a walk through the rooms of a database."""
