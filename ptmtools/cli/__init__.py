"""The `ptm` command: parses, calls one library function, prints."""
