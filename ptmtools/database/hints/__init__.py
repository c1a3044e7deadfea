"""The hints for clients that read no VRML (docs/formats/hints.md): a small index, a record of each
cell, and apart from both the statistics, which no walk needs.

Schema 1 was one file. Of willowgarage's 387 cells it took 273 kB gzipped before the first step; the
index takes 5.5, and a record 0.6.
"""
