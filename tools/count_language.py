#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
# Counts what tests/docs refuses, in pages and in the texts of the program, now or at an earlier commit:
#   tools/count_language.py [--at COMMIT] FILE.md | FOLDER ...
# A FOLDER stands for the string literals of its C++ sources. Per line: words, sentences over 25 words (pages only), refused
# words, and refused words per 1000. The list of words is that of docs/glossary.md in the working tree, also for old commits.
import re
import subprocess
import sys

MOST = 25


def refused_words(glossary):
    table = glossary[glossary.index("## Words not used"):]
    rows = [row for row in table.split("\n") if row.startswith("| ") and not row.startswith("| not |")]
    return [word.strip().lower() for row in rows for word in row[2:].split(" |")[0].split(",")]


def prose(page):
    page = re.sub(r"(?ms)^ *```.*?^ *```$", "", page)
    page = re.sub(r"`[^`\n]*`", "Code", page)
    page = re.sub(r"!?\[([^\]]*)\]\([^)]*\)", r"\1", page)
    return re.sub(r"<[^>\n]*>", "", page)


def long_sentences(page):
    blocks, block = [], ""
    for line in page.split("\n") + [""]:
        item = re.match(r"\s*([-*]|\d+\.) ", line)
        if not line.strip() or line[0] in "#|" or item:
            blocks.append(block)
            block = ""
        if line.strip() and line[0] not in "#|":
            block += " " + re.sub(r"^\s*([-*]|\d+\.) ", "", line)
    ends = re.compile(r"([.!?][)\"*]*)\s+(?=[\"`(*\[A-Z0-9])")
    sentences = [s for b in blocks for s in ends.sub(r"\1\n", re.sub(r"\b(et al|e\.g|i\.e|fig)\.", r"\1", b)).split("\n")]
    return [s for s in sentences if sum(bool(re.search(r"\w", w)) for w in s.split()) > MOST]


def strings(source):
    lines = [line.split("//")[0] for line in source.split("\n") if not line.startswith("#include")]
    return "\n".join(m for line in lines for m in re.findall(r'"((?:[^"\\]|\\.)*)"', line))


def count(text, refused):
    plain = text.lower().replace("_", " ")
    hits = sum(len(re.findall(r"(?<![\w'-])" + re.escape(word) + r"(?![\w'-])", plain)) for word in refused)
    hits += sum(m[1] != "there" and m[2] != "longer" for m in re.finditer(r"([a-z]+) (?:is|are|was|were) no ([a-z]+)", plain))
    return len(re.findall(r"[A-Za-z][A-Za-z'-]*", text)), hits


def main(arguments):
    at = ""
    if arguments[:1] == ["--at"]:
        at, arguments = arguments[1], arguments[2:]

    def read(path):
        if not at:
            return open(path, encoding="utf-8").read()
        return subprocess.run(["git", "show", at + ":" + path], check=True, capture_output=True, text=True).stdout

    refused = refused_words(open("docs/glossary.md", encoding="utf-8").read())
    print(f"{'text':<22}{'words':>7}{'long sentences':>16}{'refused':>9}{'per 1000':>10}")
    for path in arguments:
        if path.endswith(".md"):
            text = prose(read(path))
            long = str(len(long_sentences(text)))
        else:
            listing = ["git", "ls-tree", "-r", "--name-only", at or "HEAD", path]
            names = subprocess.run(listing, check=True, capture_output=True, text=True).stdout.split()
            text = "\n".join(strings(read(name)) for name in names if name.endswith((".h", ".cpp")))
            long = "-"
        words, hits = count(text, refused)
        print(f"{path:<22}{words:>7}{long:>16}{hits:>9}{1000 * hits / max(1, words):>10.1f}")


main(sys.argv[1:])
