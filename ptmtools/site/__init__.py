"""A database as a site that any visitor walks through in a browser: the page, and what it reads."""
