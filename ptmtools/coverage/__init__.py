"""Scene, cells and visibility become coverage hints (paper §5)."""
