"""The order of the stages, their artifacts and their cache."""
