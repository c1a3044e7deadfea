"""A database as a site for browsers: its files and the page, publishing and serving."""
