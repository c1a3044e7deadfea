"""Cells become potentially visible sets (paper §3)."""
