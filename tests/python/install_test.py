"""Tests `pip install ./python` without a network, from read-only source trees.

usage: install_test.py
"""

import os
import pathlib
import shutil
import subprocess
import sys
import tempfile
import unittest

import support

support.need("numpy", "setuptools", "wheel", "pip")

PINNED = (support.SOURCE / "tests/data/fingerprints.txt").read_text()
# Checks that only the installed package is found.
CHECK = """
import evalbus
from evalbus import messages
for name, kind in sorted(messages.types().items()):
    print(name, f"{kind.fingerprint:016x}")
"""


def call(command, **more):
    done = subprocess.run(
        [str(word) for word in command], capture_output=True, text=True, timeout=support.DEADLINE_S, **more
    )
    assert done.returncode == 0, (command, done.returncode, done.stdout, done.stderr)
    return done.stdout


class InstallTest(unittest.TestCase):
    def setUp(self):
        scratch = tempfile.TemporaryDirectory()
        self.addCleanup(scratch.cleanup)
        self.folder = pathlib.Path(scratch.name)
        # The source tree and an installed evalbus have different layouts.
        self.tree = self.folder / "tree"
        for name in ("python", "lcmtypes"):
            shutil.copytree(support.SOURCE / name, self.tree / name, symlinks=True,
                            ignore=shutil.ignore_patterns("__pycache__", "*.egg-info", "build"))  # fmt: skip

    def read_only(self, *command):
        """Runs the command with the tree mounted read-only, because root may write to any file."""
        mounted = 'mount --bind "$0" "$0" && mount -o remount,bind,ro "$0" && exec "$@"'
        inside = ["unshare", "--mount", "--map-root-user", "sh", "-c", mounted, self.tree]
        if subprocess.run([*inside, "true"], capture_output=True).returncode != 0:
            self.skipTest("no mount namespaces here")
        return call([*inside, *command])

    def test_from_a_read_only_tree(self):
        target = self.folder / "installed"
        self.read_only("/usr/bin/python3", "-m", "pip", "--no-cache-dir", "install", "--no-index", "--no-deps",
                       "--no-build-isolation", "--target", target, self.tree / "python")  # fmt: skip
        shutil.rmtree(self.tree)
        clean = {**os.environ, "PYTHONPATH": str(target)}
        self.assertEqual(call([sys.executable, "-c", CHECK], cwd=self.folder, env=clean), PINNED)

    def test_leaves_no_file_behind(self):
        before = sorted(self.tree.rglob("*"))
        temporary = self.folder / "tmp"
        temporary.mkdir()
        call(["/usr/bin/python3", "-m", "pip", "--no-cache-dir", "wheel", "--no-index", "--no-deps",
              "--no-build-isolation", "--wheel-dir", self.folder, self.tree / "python"],
             env={**os.environ, "TMPDIR": str(temporary)})  # fmt: skip
        self.assertEqual(sorted(self.tree.rglob("*")), before)
        self.assertEqual(list(temporary.iterdir()), [])

    def test_a_tree_without_message_definitions_is_one_line(self):
        shutil.rmtree(self.tree / "lcmtypes")
        done = subprocess.run(["/usr/bin/python3", "-m", "pip", "--no-cache-dir", "wheel", "--no-index", "--no-deps",
                               "--no-build-isolation", "--wheel-dir", self.folder, self.tree / "python"],
                              capture_output=True, text=True, timeout=support.DEADLINE_S)  # fmt: skip
        self.assertNotEqual(done.returncode, 0)
        self.assertIn("error: evalbus/lcmtypes: no message definitions", done.stdout + done.stderr)


support.main()
