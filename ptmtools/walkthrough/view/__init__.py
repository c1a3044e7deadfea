"""What is on the screen along a walk, and how wrong each level of each texture makes it look.

`pyramids` decodes the textures, `rays` finds what the pixels show, `tables` sums up their errors.
None of it depends on a client, so it is done once for a walk and serves every run.
"""
