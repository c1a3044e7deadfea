"""Parts of the sample statues."""
