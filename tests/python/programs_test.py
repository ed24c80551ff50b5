"""Tests the command `evalbus` of the wheel, with scripts in place of the programs and of PyPI's imageio-ffmpeg.

usage: programs_test.py
"""

import os
import pathlib
import shutil
import signal
import subprocess
import sys
import tempfile
import unittest

import support

# Prints its arguments, the place where it finds ffmpeg, and the mask of ignored signals (proc(5)).
PROGRAM = """#!/bin/sh
echo "$@"
echo "ffmpeg: $EVALBUS_FFMPEG"
grep SigIgn /proc/$$/status
exit 3
"""


class ProgramsTest(unittest.TestCase):
    def setUp(self):
        scratch = tempfile.TemporaryDirectory()
        self.addCleanup(scratch.cleanup)
        self.folder = pathlib.Path(scratch.name)
        self.package = self.folder / "evalbus"
        self.package.mkdir()
        (self.package / "__init__.py").touch()
        for file in ("__main__.py", "program.py", "errors.py"):
            shutil.copy(support.SOURCE / "python/evalbus" / file, self.package)

    def add_program(self):
        program = self.package / "bin/evalbus"
        program.parent.mkdir(parents=True)
        program.write_text(PROGRAM)
        program.chmod(0o755)

    def add_imageio_ffmpeg(self, body):
        (self.folder / "imageio_ffmpeg.py").write_text(f"def get_ffmpeg_exe():\n    {body}\n")

    def call(self, *arguments, **environment):
        clean = {key: value for key, value in os.environ.items() if key != "EVALBUS_FFMPEG"}
        return subprocess.run([sys.executable, "-B", "-m", "evalbus", *arguments], capture_output=True, text=True,
                              timeout=support.DEADLINE_S,
                              env={**clean, "PYTHONPATH": str(self.folder), **environment})  # fmt: skip

    def test_without_programs_is_one_line(self):
        done = self.call("doctor")
        self.assertEqual(done.returncode, 1)
        self.assertRegex(done.stderr, r"\Aerror: this installation of evalbus has no programs: .*scripts/wheel makes\n\Z")

    def test_passes_arguments_and_the_exit_code(self):
        self.add_program()
        done = self.call("run", "lift_pot", "--out", "a folder")
        self.assertEqual(done.returncode, 3, done.stderr)
        self.assertEqual(done.stdout.splitlines()[0], "run lift_pot --out a folder")

    def test_the_program_ignores_no_signals(self):
        self.add_program()
        mask = int(self.call().stdout.splitlines()[2].split()[1], 16)
        for number in (signal.SIGPIPE, signal.SIGXFSZ):
            self.assertFalse(mask & 1 << number - 1, number)

    def test_passes_the_ffmpeg_of_pypi(self):
        self.add_program()
        self.add_imageio_ffmpeg("return '/pypi/ffmpeg'")
        self.assertIn("ffmpeg: /pypi/ffmpeg\n", self.call().stdout)
        self.assertIn("ffmpeg: /mine\n", self.call(EVALBUS_FFMPEG="/mine").stdout)
        # The package reports in this way that it has no ffmpeg for this machine.
        self.add_imageio_ffmpeg("raise RuntimeError('no ffmpeg')")
        self.assertIn("ffmpeg: \n", self.call().stdout)


support.main()
