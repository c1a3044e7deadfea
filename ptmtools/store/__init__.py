"""A database on disk: its files, its manifest, and the change from one state to the next.

Nothing here depends on what a stage computes. `layout` has the names of the files, `folder` reads
them, `writer` and `transaction` write them.
"""
