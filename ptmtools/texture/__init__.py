"""One image and one `.ptm`: the progressive texture map codec (paper §4)."""
