"""How a walk is made from a database."""
