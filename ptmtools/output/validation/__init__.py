"""The check of what stands on disk: everything that a client may rely on.

`database` checks a whole one: what lies there (`files`), each file by itself (`reading`), then one
against the other, by the checks of the emitters (`vrml`, `gltf`). What a kind of file must satisfy
stands in a module of its own (`cells`, `root`, `hints`, `textures`), and so does what several kinds
have in common (`lists`, `solids`, `space`, `urls`). `findings` has the codes of all that can be
wrong.
"""
