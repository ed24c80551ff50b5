"""Functions shared by the modules that the program evalbus starts. Their errors are one line, like its own errors."""

import argparse
import sys
from typing import Callable

from evalbus.errors import EvalbusError, InputError


# Errors that a wrong file name causes. All other errors, such as a full disk, are failures of the machine.
_OF_THE_NAME = (FileExistsError, FileNotFoundError, IsADirectoryError, NotADirectoryError, PermissionError)


def run_module(main: Callable[[], None]) -> None:
    """Calls main(). Exit codes: 1 for wrong input, 130 for Ctrl-C, 2 for other failures. start_module reports missing
    packages."""
    try:
        main()
    except EvalbusError as error:
        _exit(1 if isinstance(error, InputError) else 2, str(error))
    except OSError as error:
        _exit(1 if isinstance(error, _OF_THE_NAME) else 2, " ".join(str(error).splitlines()))
    except KeyboardInterrupt:
        sys.exit(130)


def parser(module_doc: str, command: str) -> argparse.ArgumentParser:
    """Returns a parser with the name of the command that starts the module, such as 'evalbus serve'."""

    class Parser(argparse.ArgumentParser):
        def error(self, message):
            _exit(1, message)

    return Parser(prog=command, description=module_doc, formatter_class=argparse.RawDescriptionHelpFormatter)


def _exit(code: int, line: str) -> None:
    print(f"error: {line}", file=sys.stderr)
    sys.exit(code)
