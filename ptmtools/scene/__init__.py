"""A model file becomes arrays in metres, Y up."""
