"""Finds the unit and the up axis of a model, and the axes and the facing of its surfaces.

`space` decides, by the candidates that `up_axis` ranks, which measure rooms through `standing` and
cross the model with the sample lines of `facing`.
"""
