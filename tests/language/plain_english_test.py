#!/usr/bin/env python3
"""Tests plain_english.py with good and bad snippets."""
import pathlib
import sys
import unittest

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parent))
import plain_english  # noqa: E402


def rules(name, source):
    return [finding.rule.id for finding in plain_english.find(name, source)]


def lines(name, source):
    return [finding.line for finding in plain_english.find(name, source)]


class BadSnippets(unittest.TestCase):
    def test_each_rule_finds_its_form(self):
        for expected, text in {
                "starts-with-of": "Of the tick with the verdict.",
                "said-again": "The message is said again.",
                "without-a-word": "It ends without a word.",
                "somebody": "Nobody listens.",
                "who": "For who is in no hurry.",
                "says": "The sim says where it is.",
                "hears": "A component that is not heard.",
                "goes-on": "A run that is gone on with.",
                "goes-before": "The command line goes before.",
                "begins-again": "The episode is begun again.",
                "is-over": "The run is over.",
                "looks-on": "The process looks on.",
                "minds": "It minds the order.",
                "film": "The film has 30 frames.",
                "picture": "A picture of the scene.",
                "garbled": "The message is garbled.",
                "manieth": "Every so manieth tick.",
                "at-the-most": "Three tries at the most.",
                "no-use": "The server is no use.",
                "of-others": "Programs of others.",
                "british": "The colour of the pot.",
                "is-no": "A log that is no file.",
                "each-way": "64 pixels each way.",
                "belongs-into": "The file belongs into the folder.",
                "are-others": "The textures are others.",
        }.items():
            self.assertEqual(rules("a.cc", f"// {text}\nint x;\n"), [expected], text)

    def test_every_rule_of_texts_is_tried_above(self):
        tried = self.test_each_rule_finds_its_form.__code__.co_consts
        known = {word for entry in tried if isinstance(entry, tuple) for word in entry} | set(map(str, tried))
        for each in plain_english.RULES:
            if each.kinds <= plain_english.KINDS and each.id not in ("help-starts-with-of", "expected-last"):
                self.assertIn(each.id, known)

    def test_error_messages_begin_with_expected(self):
        self.assertEqual(rules("a.cc", 'throw InputError("3 values expected");\n'), ["expected-last"])
        self.assertEqual(rules("a.cc", 'Fail(fmt::format("{} values expected, got {}", n, m));\n'), ["expected-last"])
        self.assertEqual(rules("a.cc", 'throw InputError("expected 3 values, got 2: not as expected");\n'), [])

    def test_names_in_code(self):
        self.assertEqual(rules("a.h", "constexpr int kMostLinks = 40;\n"), ["kMost"])
        self.assertEqual(rules("a.cc", "MindSilence();\n"), ["old-name"])

    def test_british_verbs(self):
        self.assertEqual(rules("a.cc", "// Randomised and normalising initialisation.\n"), ["british"] * 3)

    def test_files_of_each_language(self):
        for name, source in {
                "a.cc": 'auto help = "the run is over";\n',
                "b.cc": 'auto text = R"(the run is over)";\n',
                "c.h": "/* The run is over. */\n",
                "a.lcm": "// The run is over.\n",
                "a.py": 'def f():\n  """Waits until the run is over."""\n',
                "b.py": "# The run is over.\n",
                "a.js": "const text = `the run is over`;\n",
                "b.js": "const text = 'the run is over';\n",
                "a.css": "/* The run is over. */\n",
                "a.html": "<p>The run is over.</p>\n",
                "a.md": "The run is over.\n",
                "a.yaml": "key: 1  # the run is over\n",
                "CMakeLists.txt": "# The run is over.\n",
                "script": "#!/bin/sh\n# The run is over.\n",
        }.items():
            self.assertEqual(rules(name, source), ["is-over"], name)

    def test_a_phrase_across_lines(self):
        self.assertEqual(rules("a.cc", "// A run that goes\n// on for long.\n"), ["goes-on"])
        self.assertEqual(rules("a.cc", 'f("a run that goes "\n  "on for long");\n'), ["goes-on"])
        self.assertEqual(rules("a.md", "A run that goes\non for long.\n"), ["goes-on"])

    def test_the_line_is_that_of_the_words(self):
        self.assertEqual(lines("a.cc", "int x;\n// Fine.\n// Fine, too.\n// Nobody listens.\n"), [4])
        self.assertEqual(lines("a.md", "# Title\n\n```\ncode\n```\n\nNobody listens.\n"), [7])
        self.assertEqual(lines("a.py", 'x = 1\ny = """a\nnobody listens\n"""\n'), [3])


class GoodSnippets(unittest.TestCase):
    def test_people_may_be_who(self):
        for text in ("A user who has no GPU.", "Researchers who compare checkpoints.", "The operator, who presses a key."):
            self.assertEqual(rules("a.md", text + "\n"), [], text)

    def test_plain_sentences(self):
        for text in (
                "Header of the tick at which the verdict was reached.",
                "The policy, say a checkpoint, is named here.",
                "Two processes can be told apart by their ids.",
                "The request goes on the wire.",
                "The mean is over all episodes.",
                "A precise promise, an exercise, and noise.",
                "Revision and supervision of the optimizer.",
                "There is no subscriber, and the value is no longer known.",
                "If the process is not running and the others are idle, the error is no larger than 1 mm.",
        ):
            self.assertEqual(rules("a.cc", f"// {text}\n"), [], text)

    def test_code_and_names_are_no_text(self):
        for name, source in {
                "a.cc": '#include "viz/pictures/film.h"\nconst char* key = "film";\nint film = picture;\n',
                "b.cc": "// See viz/pictures/panel_film.h and `film`.\n",
                "a.md": "```\n$ evalbus run --film  # nobody says\n```\nUse `picture`. [x](picture.md)\n",
                "a.html": "<script>// nobody</script><p class='film'>Fine.</p>\n",
                "a.js": 'const a = "http://nobody";\n',
        }.items():
            self.assertEqual(rules(name, source), [], name)

    def test_an_apostrophe_in_code_is_no_string(self):
        self.assertEqual(rules("a.cc", "const int n = 10'000;  // Fine.\nconst char c = '\"';\n"), [])


if __name__ == "__main__":
    unittest.main()
