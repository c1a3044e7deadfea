"""Ways to code one tile of one level, each in a folder of its own.

A coder turns arrays into bytes and back; it knows nothing of files, levels or profiles. Its
compiled loops are in its ``kernels.py`` and in the files that this imports.
"""
