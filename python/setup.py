"""Builds in a temporary folder, so that `pip install ./python` does not write to the source tree."""

import atexit
import pathlib
import shutil
import sys
import tempfile

import setuptools

if not list(pathlib.Path(__file__).parent.glob("evalbus/lcmtypes/*.lcm")):
    sys.exit("error: evalbus/lcmtypes: no message definitions; it is a link to lcmtypes/ beside python/: copy both folders")
folder = tempfile.mkdtemp(prefix="evalbus-build-")
atexit.register(shutil.rmtree, folder, ignore_errors=True)
setuptools.setup(options={"build": {"build_base": folder}, "egg_info": {"egg_base": folder}})
