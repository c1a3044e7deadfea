"""Artifacts → VRML97: `root.wrl` and a file for every cell; and back: the strict reader of both.

docs/formats/database.md says what is in them.
"""
