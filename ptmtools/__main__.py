"""``python -m ptmtools`` is ``ptm``."""

from ptmtools.cli.main import run

if __name__ == "__main__":
    run()
