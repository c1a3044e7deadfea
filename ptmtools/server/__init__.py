"""`ptm serve`: a database, or what `ptm publish` wrote, over HTTP to browsers on this machine.

A server for looking and for measuring, not for the public: static hosts do that
(docs/guide/publish.md). What it adds to them is a link that is as thin as one likes
(`ptmtools.server.throttle`), and a list of what was asked for (`ptmtools.server.visits`).
"""
