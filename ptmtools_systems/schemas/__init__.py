"""Names of the schemas of the indexes of these systems, see `ptmtools.schemas.schema_text`."""

APO, CAMPUS, INTERLACE = (f"{__name__}:{name}" for name in ("apo", "campus", "interlace"))
