"""Parts of the sample campus."""
