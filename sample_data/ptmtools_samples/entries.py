"""The command that the package of samples adds to `ptm`."""

from ptmtools.cli.entry import Entry

SAMPLE = Entry("Start", "Write a model to try ptmtools on.", "ptmtools_samples.command:sample")
