"""Where a walk begins, and the places by which one comes from room to room (paper §6).

`placement` says which they are. It finds the floor below an eye (`ground`), places to stand in the
rooms (`rooms`), where to look from them (`outlook`, `pictures`), and in which order to walk
through (`tour`).
"""
