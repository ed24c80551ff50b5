#!/usr/bin/env python3
"""Checks that the tests which docs name as `Suite.Name` or `Suite.Prefix*`, and the files which docs and comments name
with their path from the root, exist.
"""
import fnmatch
import re
import sys

from plain_english import ROOT, files_under, units

TEST = re.compile(r"\b(?:TEST|TEST_F|TEST_P|TYPED_TEST)\(\s*(\w+),\s*(\w+)\)")
NAMED_TEST = re.compile(r"`([A-Z]\w*\.(?:[A-Z]\w*\*?|\*))`")
NAMED_FILE = re.compile(r"(?<![\w/.{<$-])((?:base|bus|cli|cmake|collision|docs|export|lcmtypes|metrics|models|plans|policy_bridge|"
                        r"report|results|runner|scripts|sim|tests|viz)/[a-z0-9_/]+\.(?:h|cc|py|js|md|lcm|cmake))\b")


def line(text, place):
    return text.count("\n", 0, place) + 1


def main():
    sources = {}
    for name in files_under(["."]):
        try:
            sources[name] = (ROOT / name).read_text(encoding="utf-8")
        except UnicodeDecodeError:
            pass  # the file is an image or a log
    tests = set()
    for name, text in sources.items():
        if name.startswith("tests/") and name.endswith(".cc"):
            tests |= {".".join(match) for match in TEST.findall(text)}
    missing = []
    for name, text in sources.items():
        if name == "CHANGELOG.md":
            continue  # names tests and files that existed at the time
        if name.endswith(".md"):
            missing += [f"{name}:{line(text, match.start())}: there is no test {match[1]}" for match in NAMED_TEST.finditer(text)
                        if not fnmatch.filter(tests, match[1])]
        for unit in units(name, text):
            if unit.kind in ("comment", "prose"):
                missing += [f"{name}:{unit.line + line(unit.text, match.start()) - 1}: there is no file {match[1]}"
                            for match in NAMED_FILE.finditer(unit.text) if not (ROOT / match[1]).exists()]
    print("\n".join(missing + [f"{len(missing)} findings in {len(sources)} files, {len(tests)} tests"]))
    return 1 if missing or not tests else 0


if __name__ == "__main__":
    sys.exit(main())
