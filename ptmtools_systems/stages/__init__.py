"""The stages that the neighbouring systems add to a build."""
