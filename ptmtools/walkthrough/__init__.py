"""A walk over a modelled link, and what the walker sees of it (docs/design/walkthrough.md)."""
