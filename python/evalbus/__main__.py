"""The commands `evalbus` and `python -m evalbus` of the wheel: start the program that the wheel contains."""

import os
import pathlib
import signal
import sys

from evalbus.program import environment

PROGRAM = pathlib.Path(__file__).resolve().parent / "bin" / "evalbus"


def main():
    if not PROGRAM.exists():
        sys.exit("error: this installation of evalbus has no programs: it was made from python/; install the wheel that "
                 "scripts/wheel makes")  # fmt: skip
    # Python ignores these signals, and the program would inherit this setting.
    for number in (signal.SIGPIPE, signal.SIGXFSZ):
        signal.signal(number, signal.SIG_DFL)
    os.execve(PROGRAM, [str(PROGRAM), *sys.argv[1:]], environment())


if __name__ == "__main__":
    main()
