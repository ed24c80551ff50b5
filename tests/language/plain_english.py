#!/usr/bin/env python3
"""Checks that comments, texts and docs are plain technical English.

  plain_english.py              checks the folders listed in checked.txt; exits with 1 if there is a finding
  plain_english.py --spelling   checks their spelling with codespell (American English); exits with 77 without codespell
  plain_english.py --all        prints the number of findings per folder and rule for the whole tree
  plain_english.py PATH...      checks these files or folders

A finding is printed as FILE:LINE: RULE: TEXT (what to write instead).
"""
import argparse
import collections
import io
import pathlib
import re
import shutil
import subprocess
import sys
import tokenize

HERE = pathlib.Path(__file__).resolve().parent
ROOT = HERE.parents[1]

# These files are not checked: data, other people's files, and this folder, which quotes what it bans.
EXCLUDED = re.compile(r"^(tests/language/|tests/data/|tests/fuzz/corpus/|LICENSE$|CODE_OF_CONDUCT)")

PEOPLE = ("user|person|people|anyone|engineer|researcher|developer|contributor|operator|author|maintainer|"
          "reader|reviewer|scientist|colleague|newcomer|student|annotator|attacker")
KINDS = {"comment", "string", "prose"}

Rule = collections.namedtuple("Rule", "id pattern instead kinds")


def rule(id_, pattern, instead, kinds=KINDS, flags=re.IGNORECASE):
    # A blank in a pattern matches any number of blanks. In a lookbehind, whose width is fixed, it matches
    # one.
    parts = re.split(r"(\(\?<[=!][^)]*\))", pattern)
    pattern = "".join(part if part.startswith("(?<") else re.sub(r"(?<!\[) ", " +", part) for part in parts)
    return Rule(id_, re.compile(pattern, flags), instead, set(kinds))


# If two rules match the same words, the first rule counts.
RULES = [
    rule("starts-with-of", r"\AOf\b|(?<=[.!?] )Of (?=a\b|an\b|the\b|each\b|what\b)", "begin with the noun that is described",
         {"comment"}, 0),
    rule("help-starts-with-of", r"\Aof (?=a\b|an\b|the\b|each\b|what\b)", "begin with the noun that is described", {"string"}),
    rule("said-again", r"\b(say|says|said|saying) (?:it |them |that )?again\b", "repeat, resend"),
    rule("without-a-word", r"\bwithout (saying )?a word\b|\bnot a word\b", "silently; without an error message"),
    rule("somebody", r"\b(nobody|somebody|everybody)\b(?:'s)?", "name the process: no subscriber, another process, every observer"),
    rule("who", rf"(?<!\buser )(?<!\busers )\b(who|whoever|whom)\b", "a program is 'that' or 'which'; name it"),
    rule("says", r"\b(says|said|saying|tells|told|telling)\b(?! apart)|\b(to|not|cannot|can|must|may|will|would|should|they|it|and)"
         r" (say|tell)\b(?! apart)(?-i:(?<!CANNOT TELL))", "publishes, reports, logs, states, contains"),
    rule("hears", r"\b(hears|heard|hearing)\b|\b(to|not|cannot|can|must|may|will) hear\b", "receives"),
    rule("goes-on", r"\b(go|goes|went|going|gone) on\b(?! (?:the|a|an|top|each|its)\b)", "continues, resumes, is active, is running"),
    rule("goes-before", r"\bgo(?:es)? before\b", "takes precedence; precedes"),
    rule("begins-again", r"\b(begin|begins|began|begun|beginning) again\b", "retries, restarts"),
    rule("is-over", r"\b(is|are|was|were|be|been) over\b(?! (?:the|a|an|all|\d))", "has finished, has ended"),
    rule("looks-on", r"\blook(?:s|ed|ing)? on\b(?! (?:the|a|an)\b)|\b(?:on)?lookers?(?:-on)?\b", "observes; observer"),
    rule("minds", r"\bminds\b|\bminding\b|\bmind (?:what|it|them)\b", "checks, handles, depends on"),
    rule("film", r"(?<![\w/.-])(?:film|films|filmed|filming|filmer)(?![\w/:(=-])(?!\.\w)", "video; record"),
    rule("picture", r"(?<![\w/.-])(?:picture|pictures|pictured)(?![\w/:(=-])(?!\.\w)", "image; figure"),
    rule("garbled", r"\bgarbled\b", "undecodable"),
    rule("manieth", r"\bmanieth\b|\bso manyth\b", "n-th"),
    rule("at-the-most", r"\bat the (?:most|least)\b(?! \w+ly)", "at most, at least"),
    rule("no-use", r"\bis (?:of )?no use\b", "failed; cannot be used"),
    rule("of-others", r"\b(?:of|from|for|by) (?:others|theirs|ours)\b", "name whose: third-party, external, evalbus' own"),
    rule("british", r"\b(?:colours?|coloured|centres?|centred|behaviours?|neighbours?|neighbouring|grey|cancelled|"
         r"labelled|modelled|travelled|(?:[a-z]+)(?<!prom)(?<!rev)(?<!adv)(?<!superv)(?<!surpr)(?<!exerc)(?<!compr)(?<!no)(?<!r)"
         r"is(?:ation|ations|ational))\b|\b(?:random|initial|normal|serial|optim|summar|recogn|organ|visual|synchron|util|minim|"
         r"maxim|real|general|quant|parameter|standard|character|formal|author|local|final|special|discret|emphas)is(?:e|es|ed|ing)\b",
         "American spelling: color, center, behavior, -ize"),
    rule("is-no", r"(?<!there )\b(?:is|are|was|were) no (?!longer\b|more\b|less\b|fewer\b|\w+er than\b|\w+ is\b)", "is not a, is not"),
    rule("each-way", r"\beach way\b(?! to\b)", "per side"),
    rule("belongs-into", r"\bbelongs? into\b", "belongs in"),
    rule("are-others", r"\b(?:is another|are others)(?=[.;:,]| than\b| and\b|\Z)", "differs, differ"),
    rule("expected-last", r"(?<!as )(?<!than )(?<!is )(?<!are )(?<!was )(?<!were )\bexpected(?:\Z|, (?:not|got)\b)",
         "begin with 'expected'", {"string"}),
    rule("kMost", r"\bkMost[A-Z]\w*", "kMax...", {"code"}, 0),
    rule("old-name", r"\b(?:FilmCrew|FilmProgress|MindSilence|TellLosses|SayFilesThatMayNotGrow|IsWhatItCarries|IsNews|WhatIsKnown|"
         r"RemoveUnknown|TakeAway|SetPatience|barred_geom|seen_picture_t|observe_t|hello_t)\b",
         "the name in the table of terms", {"code"}, 0),
]

# Sentences about people may use "who".
ABOUT_PEOPLE = re.compile(rf"\b(?:{PEOPLE})s?,?\s+(?:who|whom)\Z", re.IGNORECASE)

Unit = collections.namedtuple("Unit", "kind line text")
Finding = collections.namedtuple("Finding", "file line rule text")

C_TOKENS = re.compile(
    r'(?P<raw>\bR"(?P<delimiter>[^\s()\\]{0,16})\((?P<raw_text>.*?)\)(?P=delimiter)")'
    r'|(?P<line_comment>//[^\n]*)|(?P<block_comment>/\*.*?\*/)'
    r'|(?P<string>"(?:[^"\\\n]|\\.)*")|(?P<char>(?<![0-9A-Fa-f])\'(?:[^\'\\\n]|\\.)*\')', re.DOTALL)
JS_TOKENS = re.compile(
    r'(?P<line_comment>(?<![:\\])//[^\n]*)|(?P<block_comment>/\*.*?\*/)'
    r'|(?P<string>"(?:[^"\\\n]|\\.)*"|\'(?:[^\'\\\n]|\\.)*\'|`(?:[^`\\]|\\.)*`)', re.DOTALL)
CSS_TOKENS = re.compile(r"(?P<block_comment>/\*.*?\*/)", re.DOTALL)
HASH_COMMENT = re.compile(r"(?:^|(?<=\s))#(?!!)[^\n]*", re.MULTILINE)


def blanked(match):
    return re.sub(r"[^\n]", " ", match.group(0))


def plain(text):
    """Replaces quoted code and addresses by blanks. Offsets do not change."""
    return re.sub(r"`[^`]*`|https?://\S+|<!--.*?-->", blanked, text, flags=re.DOTALL)


def joined(units, source):
    """Comments on consecutive lines are one comment; string literals with nothing but white space between are one string."""
    result = []
    for kind, start, end, text in units:
        if result and result[-1][0] == kind and kind in ("comment", "string"):
            between = source[result[-1][2]:start]
            if between.strip() == "" and between.count("\n") <= 1 and (kind == "string" or "\n" in between):
                result[-1] = (kind, result[-1][1], end, result[-1][3] + [(start, text)])
                continue
        result.append((kind, start, end, [(start, text)]))
    return result


def located(groups, source):
    """Returns units whose text has a line break wherever the source has one, so that a match reveals its line."""
    for kind, _, _, pieces in groups:
        text, line = "", source.count("\n", 0, pieces[0][0]) + 1
        for start, piece in pieces:
            missing = source.count("\n", 0, start) + 1 - line - text.count("\n")
            text += "\n" * missing + piece
        yield Unit(kind, line, text)


def without_markers(comment):
    """Returns a comment without // or /* and the like, of the same length except for leading blanks."""
    if comment.startswith("/*"):
        return re.sub(r"(?m)^\s*\*", " ", comment[2:-2]).strip(" ")
    return re.sub(r"^(?:///?<?|#+)\s?", "", comment)


def tokens(source, pattern):
    found = []
    for match in pattern.finditer(source):
        if match.lastgroup is None:
            continue
        group = match.groupdict()
        if group.get("line_comment") or group.get("block_comment"):
            found.append(("comment", match.start(), match.end(), without_markers(match.group(0))))
        elif group.get("string"):
            line = source[source.rfind("\n", 0, match.start()) + 1:match.start()]
            if "#include" not in line:
                found.append(("string", match.start(), match.end(), match.group(0)[1:-1].replace("\\n", " ")))
        elif group.get("raw"):
            found.append(("string", match.start(), match.end(), group["raw_text"]))
    return located(joined(found, source), source)


def hash_comments(source):
    found = [("comment", m.start(), m.end(), without_markers(m.group(0))) for m in HASH_COMMENT.finditer(source)]
    return located(joined(found, source), source)


def python_units(source):
    starts = [0]
    for line in source.splitlines(keepends=True):
        starts.append(starts[-1] + len(line))
    offset = lambda place: starts[place[0] - 1] + place[1]
    found = []
    for token in tokenize.generate_tokens(io.StringIO(source).readline):
        if token.type == tokenize.COMMENT and not token.string.startswith("#!"):
            found.append(("comment", offset(token.start), offset(token.end), without_markers(token.string)))
        elif token.type == tokenize.STRING:
            text = re.sub(r"^\w*(\"\"\"|'''|\"|')(.*)\1$", r"\2", token.string, flags=re.DOTALL)
            found.append(("string", offset(token.start), offset(token.end), text))
    return located(joined(found, source), source)


def markdown_units(source):
    text = re.sub(r"^([ \t]*)(```|~~~).*?^[ \t]*\2[ \t]*$", blanked, source, flags=re.DOTALL | re.MULTILINE)
    text = re.sub(r"\]\([^)]*\)", blanked, text)
    yield Unit("prose", 1, text)


def units(name, source):
    path = pathlib.PurePath(name)
    if path.suffix in (".cc", ".h", ".cpp", ".lcm"):
        yield from tokens(source, C_TOKENS)
    elif path.suffix in (".js", ".mjs"):
        yield from tokens(source, JS_TOKENS)
    elif path.suffix == ".css":
        yield from tokens(source, CSS_TOKENS)
    elif path.suffix == ".html":
        yield Unit("prose", 1, re.sub(r"<(script|style)\b.*?</\1>|<[^>]*>", blanked, source, flags=re.DOTALL))
    elif path.suffix == ".py":
        yield from python_units(source)
    elif path.suffix == ".md":
        yield from markdown_units(source)
    elif path.suffix in (".cmake", ".sh", ".bash", ".sed", ".yaml", ".yml", ".def", ".in", ".toml", ".cfg") or path.name in (
            "CMakeLists.txt", "Dockerfile") or source.startswith("#!"):
        yield from hash_comments(source)
    else:
        return
    yield Unit("code", 1, source)


def find(name, source):
    """Returns the findings in a file's text."""
    for unit in units(name, source):
        if unit.kind == "string" and " " not in unit.text.strip():
            continue  # the text is a name or a key
        text = plain(unit.text) if unit.kind != "code" else unit.text
        # A phrase may be broken over two lines.
        flat = text.replace("\n", " ")
        taken = []
        for each in RULES:
            if unit.kind not in each.kinds:
                continue
            for match in each.pattern.finditer(flat):
                if any(match.start() < end and start < match.end() for start, end in taken):
                    continue
                if each.id == "who" and ABOUT_PEOPLE.search(re.sub(r" +", " ", flat[:match.end()])):
                    continue
                taken.append(match.span())
                around = flat[max(0, match.start() - 30):match.end() + 40].strip()
                yield Finding(name, unit.line + text.count("\n", 0, match.start()), each, re.sub(r"\s+", " ", around))


def files_under(paths):
    listed = subprocess.run(["git", "ls-files", "--cached", "--others", "--exclude-standard", "--", *paths], cwd=ROOT,
                            check=True, capture_output=True, text=True).stdout.split("\n")
    return sorted({f for f in listed if f and not EXCLUDED.match(f) and (ROOT / f).is_file()})


def findings(files):
    for name in files:
        try:
            source = (ROOT / name).read_text(encoding="utf-8")
        except UnicodeDecodeError:
            continue  # the file is an image or a log
        yield from find(name, source)


def checked_paths():
    lines = (HERE / "checked.txt").read_text(encoding="utf-8").splitlines()
    return [line.strip() for line in lines if line.strip() and not line.startswith("#")]


def print_table():
    counts = collections.Counter()
    for finding in findings(files_under(["."])):
        parts = finding.file.split("/")
        folder = "/".join(parts[:2]) if parts[0] in ("cli", "tests", "viz") and len(parts) > 2 else parts[0]
        counts[folder if len(parts) > 1 else ".", finding.rule.id] += 1
    folders = sorted({folder for folder, _ in counts})
    used = [r.id for r in RULES if any((f, r.id) in counts for f in folders)]
    for folder in folders:
        of_rules = {id_: counts[folder, id_] for id_ in used if counts[folder, id_]}
        print(f"{sum(of_rules.values()):6} {folder:24} " + ", ".join(f"{k} {v}" for k, v in of_rules.items()))
    print(f"{sum(counts.values()):6} {'total':24} " + ", ".join(
        f"{id_} {sum(v for (_, r), v in counts.items() if r == id_)}" for id_ in used))


def check_spelling():
    if not shutil.which("codespell"):
        print("codespell is not installed")
        return 77
    files = files_under(checked_paths())
    return subprocess.run(["codespell", "--builtin", "clear,rare,en-GB_to_en-US", "--ignore-words",
                           str(HERE / "spelling_ignored.txt"), *files], cwd=ROOT).returncode


def main():
    parser = argparse.ArgumentParser(description="Checks that comments, texts and docs are plain technical English.")
    parser.add_argument("paths", nargs="*", help="files or folders; default: those in checked.txt")
    parser.add_argument("--all", action="store_true", help="print the number of findings per folder and rule")
    parser.add_argument("--spelling", action="store_true", help="check the spelling of the folders in checked.txt")
    options = parser.parse_args()
    if options.all:
        print_table()
        return 0
    if options.spelling:
        return check_spelling()
    files = files_under(options.paths or checked_paths())
    if not files:
        print("error: no file to check")
        return 1
    found = list(findings(files))
    for finding in found:
        print(f"{finding.file}:{finding.line}: {finding.rule.id}: {finding.text} (write: {finding.rule.instead})")
    print(f"{len(found)} findings in {len(files)} files")
    return 1 if found else 0


if __name__ == "__main__":
    sys.exit(main())
