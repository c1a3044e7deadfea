"""The version of the package; the formats carry versions of their own."""

__version__ = "0.2.0"
