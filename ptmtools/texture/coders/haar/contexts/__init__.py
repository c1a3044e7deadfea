"""Compiled loops of what is known of a row before its first residual."""
