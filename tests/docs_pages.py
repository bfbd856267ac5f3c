"""The pages of the documentation, cut into links, blocks of code and command lines."""

import re
import shlex
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
PAGES = [*sorted(ROOT.glob("*.md")), *sorted((ROOT / "docs").rglob("*.md"))]
NAMES = [str(page.relative_to(ROOT)) for page in PAGES]
FENCE = re.compile(r"^ *```+ *(\w*)")
COMMANDS = ("gensig", "diagnose")


@dataclass(frozen=True, slots=True, kw_only=True)
class Block:
    """A fenced or indented block: line (from 1), language or "", code, and the comment above."""

    line: int
    language: str
    code: str
    mark: str


def blocks(text: str) -> Iterator[Block]:
    """Blocks of a page; indented blocks follow an empty line or a heading outside of lists."""
    lines = text.split("\n")
    place, in_list = 0, False
    while place < len(lines):
        line = lines[place]
        above = next((text for text in reversed(lines[:place]) if text.strip()), "")
        mark = above[4:-3].strip() if above.startswith("<!--") else ""
        begin, result = place, FENCE.match(line)
        if result:
            while not FENCE.match(lines[place + 1]):
                place += 1
            place += 1
            yield Block(
                line=begin + 1,
                language=result[1],
                code="\n".join(lines[begin + 1 : place]),
                mark=mark,
            )
        elif (
            line.startswith("    ")
            and not in_list
            and (not lines[place - 1].strip() or above.startswith("#"))
        ):
            while place + 1 < len(lines) and (
                lines[place + 1].startswith("    ") or not lines[place + 1].strip()
            ):
                place += 1
            code = "\n".join(text[4:] for text in lines[begin : place + 1])
            yield Block(line=begin + 1, language="", code=code, mark=mark)
        elif re.match(r"(- |\* |\d+\. )", line):
            in_list = True
        elif line.strip() and not line.startswith(" "):
            in_list = False
        place += 1


def without_blocks(text: str) -> str:
    """A page without its blocks and inline code, for what is written in prose only."""
    hidden: set[int] = set()
    for block in blocks(text):
        hidden |= set(range(block.line, block.line + block.code.count("\n") + 3))
    kept = [
        line for number, line in enumerate(text.split("\n"), 1) if number not in hidden
    ]
    return re.sub(r"`[^`]*`", "", "\n".join(kept))


def command_lines(text: str) -> Iterator[tuple[int, list[str]]]:
    """Line and words of every gensig and diagnose command in the shell blocks of a page."""
    for block in blocks(text):
        if block.language not in ("", "sh", "bash"):
            continue
        for line in block.code.replace("\\\n", " ").split("\n"):
            if not line.strip().startswith(COMMANDS):
                continue
            words = shlex.split(line, comments=True)
            while words:
                end = next(
                    (
                        k
                        for k, word in enumerate(words)
                        if word in ("&&", "||", "|", ">", "&")
                    ),
                    len(words),
                )
                if words[0] in COMMANDS:
                    yield block.line, words[:end]
                words = words[end + 1 :]


def anchors(text: str) -> set[str]:
    """Anchors of a page's headings, as code forges and the site make them."""
    result: set[str] = set()
    fenced = False
    for line in text.split("\n"):
        if FENCE.match(line):
            fenced = not fenced
        if heading := re.match(r"#{1,6} (.*)", line) if not fenced else None:
            plain = (
                re.sub(r"\[([^\]]*)\]\([^)]*\)", r"\1", heading[1])
                .replace("`", "")
                .strip()
                .lower()
            )
            slug = re.sub(r"[^\w\- ]", "", plain).replace(" ", "-")
            n_before = sum(
                name == slug
                or re.fullmatch(rf"{re.escape(slug)}-\d+", name) is not None
                for name in result
            )
            result.add(f"{slug}-{n_before}" if n_before else slug)
    return result
