"""Counting what the pixels of item buffers show (`item_buffer`)."""
