"""Samples of 16 bits, floats, and errors that are allowed. `coder` says how."""

from ptmtools.texture.coders.texel.coder import decode, encode

__all__ = ["decode", "encode"]
