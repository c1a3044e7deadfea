"""Finds the unit and the up axis of a model, and the axes and the facing of its surfaces.

`space` decides by the candidates that `up_axis` ranks. These measure the rooms (`room_sizes`) along
sample lines through the model (`facing`).
"""
