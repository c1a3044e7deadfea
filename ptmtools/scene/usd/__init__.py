"""Reads USD through usd-core, in a process of its own.

`read_usd` in `reader` is the way in; `layers` opens a stage, `drawn` finds what of it is drawn, and
`source` makes triangles of that.
"""
