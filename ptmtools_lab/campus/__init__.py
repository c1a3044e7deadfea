"""A walk through a campus with the client of its paper (notes, section 4; the paper's III and IV).

A campus (`ptm campus`) is not a database: it has no cells, and no file with all levels of a
texture. Meshes and textures are files that a client loads whole, so its client is not a `Client` of
`ptmtools_lab.policies`. Link, camera, walk and the error of the picture are the same.
`prepare_campus` compares with the full picture of a database of the same model, if one is given.
"""
