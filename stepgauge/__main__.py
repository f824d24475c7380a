"""``stepgauge``, and ``python -m stepgauge``, which puts the working folder before all modules: it is taken away."""

import os
import sys


def main() -> None:
    """The command, with no module out of the folder in which it is called."""
    here, package = os.path.realpath(os.getcwd()), os.path.dirname(os.path.dirname(os.path.realpath(__file__)))
    sys.path[:] = [one for one in sys.path if one and (os.path.realpath(one) != here or here == package)]
    from stepgauge.cli import main as command

    command()


if __name__ == "__main__":
    main()
