"""``stepgauge``, and ``python -m stepgauge``, which puts the working folder before all modules: it is taken away."""

import os
import sys


def main() -> None:
    """The command, with no module out of the folder in which it is called."""
    try:
        here = os.path.realpath(os.getcwd())
    except FileNotFoundError:  # it was deleted under the shell that stands in it
        sys.stderr.write("stepgauge: error: the folder in which it is called is not there any more; go to another\n")
        sys.exit(2)
    package = os.path.dirname(os.path.dirname(os.path.realpath(__file__)))
    sys.path[:] = [one for one in sys.path if one and (os.path.realpath(one) != here or here == package)]
    from stepgauge.cli import main as command

    command()


if __name__ == "__main__":
    main()
