"""Buffer views compressed with meshopt: the codecs of EXT_meshopt_compression."""
