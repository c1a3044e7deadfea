"""Renders a served database: rays, sampled textures, shaded frames."""
