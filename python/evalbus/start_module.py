"""Starts a module of this package for the program evalbus: start_module.py MODULE [ARGUMENT...].

It does not import the package, so that a missing numpy is also reported in one line.
"""

import runpy
import sys

if __name__ == "__main__":
    # Replaces the folder of this file in the import path by the current folder, as `python -m` does, because the
    # modules of this folder would hide others with the same name, such as gym.
    sys.path[0] = ""
    del sys.argv[0]
    try:
        runpy.run_module(sys.argv[0], run_name="__main__", alter_sys=True)
    except ImportError as error:
        package = (error.name or str(error)).partition(".")[0]
        print(
            f"error: {sys.executable} has no {package}: install it, or set EVALBUS_PYTHON to a Python that has it",
            file=sys.stderr,
        )
        sys.exit(2)
