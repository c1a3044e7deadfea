"""The check of the files on disk: `database` checks a whole database or one `.ptm`.

Each kind of file has a module (`vrml`, `gltf`, `hints`, `textures`); `space` checks the geometry of
the hints, `files` lists the served files and resolves URLs, `findings` has all codes.
"""
