"""Names of the schemas of reports in JSON, see `ptmtools.schemas.schema_text`."""

SIMULATION, CAMPUS_WALK = (f"{__name__}:{name}" for name in ("simulation", "campus_walk"))
