"""What a database is on disk: its files, its manifest, and how one state follows another.

Nothing here knows what a stage computes. `layout` has the names of files, `folder` reads,
`writer` and `transaction` write one.
"""
