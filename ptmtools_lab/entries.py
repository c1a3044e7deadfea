"""The commands that the laboratory adds to `ptm`."""

from ptmtools.cli.entry import Entry

HEADING = "Experiments"

PATH = Entry(
    HEADING,
    "Generate a walk through every room of a database.",
    "ptmtools_lab.cli.simulation:path_command",
)
SIMULATE = Entry(
    HEADING,
    "Simulate visitors and the clients that load a database for them.",
    "ptmtools_lab.cli.simulation:simulate",
)
WALK_CAMPUS = Entry(
    HEADING, "Simulate a walk through a campus.", "ptmtools_lab.cli.simulation:walk_campus"
)
TRADEOFF = Entry(
    HEADING,
    "Measure the cost and the benefit of each option.",
    "ptmtools_lab.cli.tradeoff:tradeoff",
)
COMPARE = Entry(
    "Images", "Compare .ptm with other image formats.", "ptmtools_lab.cli.codecs:compare"
)
