"""Parts of the sample atrium."""
