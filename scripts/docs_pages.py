#!/usr/bin/env python3
"""Used by scripts/docs.

  docs_pages.py gather   copies docs/, README.md and the project's pages to build/docs for mkdocs. Links to files that
                         are not pages become plain text. Exits with 1 if the target of a link is missing.
  docs_pages.py check    exits with 1 if a link in build/site points to a missing file or heading.
"""
import html.parser
import pathlib
import posixpath
import re
import shutil
import sys
import urllib.parse

ROOT = pathlib.Path(__file__).resolve().parents[1]
PAGES = ROOT / "build/docs"
SITE = ROOT / "build/site"
# Maps pages outside docs/ to their names in the site.
PROJECT_PAGES = {"README.md": "index.md", "CHANGELOG.md": "CHANGELOG.md", "CONTRIBUTING.md": "CONTRIBUTING.md",
                 "SECURITY.md": "SECURITY.md"}
LINK = re.compile(r"(!?)\[((?:[^\[\]]|\[[^\]]*\])*)\]\(([^()\s]+)\)")
FENCE = re.compile(r"^(```|~~~).*?^\1", re.DOTALL | re.MULTILINE)


def in_site(path):
    """Returns the name in the site of a file in the repository; None if it is not part of the site."""
    name = path.relative_to(ROOT).as_posix()
    if name in PROJECT_PAGES:
        return PROJECT_PAGES[name]
    return name[len("docs/"):] if name.startswith("docs/") and path.is_file() else None


def gather_page(source, broken):
    text = source.read_text(encoding="utf-8")
    fenced = [match.span() for match in FENCE.finditer(text)]

    def link(match):
        image, label, target = match.groups()
        if any(start <= match.start() < end for start, end in fenced) or re.match(r"[a-z]+:|#", target):
            return match.group(0)
        path, _, heading = target.partition("#")
        file = (source.parent / path).resolve()
        if not file.is_relative_to(ROOT) or not file.exists():
            line = text.count("\n", 0, match.start()) + 1
            broken.append(f"{source.relative_to(ROOT)}:{line}: there is no file {target}")
            return match.group(0)
        name = in_site(file)
        if name is None:
            return label
        name = posixpath.relpath(name, posixpath.dirname(in_site(source)))
        return f"{image}[{label}]({name}{'#' + heading if heading else ''})"

    return LINK.sub(link, text)


def gather():
    shutil.rmtree(PAGES, ignore_errors=True)
    shutil.copytree(ROOT / "docs", PAGES, ignore=shutil.ignore_patterns("*.md"))
    broken = []
    for source in [*sorted((ROOT / "docs").rglob("*.md")), *(ROOT / name for name in PROJECT_PAGES)]:
        page = PAGES / in_site(source)
        page.parent.mkdir(exist_ok=True)
        page.write_text(gather_page(source, broken), encoding="utf-8")
    return broken


class Page(html.parser.HTMLParser):
    def __init__(self, file):
        super().__init__()
        self.ids, self.links = set(), []
        self.feed(file.read_text(encoding="utf-8"))

    def handle_starttag(self, tag, attrs):
        attributes = dict(attrs)
        self.ids.update(value for key, value in attrs if key in ("id", "name") and value)
        link = attributes.get("href") if tag == "a" else attributes.get("src") if tag == "img" else None
        if link:
            self.links.append(link)


def check():
    pages = {file: Page(file) for file in SITE.glob("*.html")}
    broken = []
    for file, page in pages.items():
        if file.name == "404.html":
            continue
        for link in page.links:
            url = urllib.parse.urlsplit(link)
            if url.scheme or url.netloc:
                continue
            target = (file.parent / urllib.parse.unquote(url.path)).resolve() if url.path else file
            heading = urllib.parse.unquote(url.fragment)
            target = target / "index.html" if target.is_dir() else target
            if not target.exists():
                broken.append(f"{file.name}: there is no file {link}")
            elif heading and target in pages and heading not in pages[target].ids:
                broken.append(f"{file.name}: there is no heading {link}")
    return broken if pages else ["build/site has no page"]


def main():
    broken = {"gather": gather, "check": check}[sys.argv[1]]()
    for each in sorted(set(broken)):
        print(f"error: {each}", file=sys.stderr)
    return 1 if broken else 0


if __name__ == "__main__":
    sys.exit(main())
