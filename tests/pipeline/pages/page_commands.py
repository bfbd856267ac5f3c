"""The commands of pages, as they can be typed on this machine."""

from collections.abc import Sequence
from pathlib import Path

from docs_pages import PAGES, ROOT, command_lines

EXAMPLES = ROOT / "docs" / "commands.md"
# beginnings of commands -> test that runs them
ELSEWHERE = {
    ("gensig", "validate"): "tests/literature/test_validation_document.py",
    ("diagnose", "score"): "tests/unit/diagnose/scoring/test_scoring.py",
}
# the verb ``bridge`` with a set of residuals, in parts
JUDGED_IN = "tests/unit/diagnose/bridge/test_bridge_end_to_end.py"
# words of a page that no machine but the reader's has
HERE = {
    "...": "experiment=quickstart",
    "/shared/large": "runs/shared",
    "out=/shared/large": "out=runs/shared",
    "executor.address=tcp://10.0.0.1:8786": "executor.n_workers=1",
}
SLURM = {"ARRAY_TASK_ID": "0", "ARRAY_TASK_COUNT": "1", "CPUS_PER_TASK": "1"}
CLOSING = ("finalize", "verify", "reproduce")  # a page on arrays shows their jobs later


def commands(page: Path) -> list[list[str]]:
    """Words of the commands of a page that run here."""
    found = [
        [HERE.get(word, word) for word in words]
        for _, words in command_lines(page.read_text(encoding="utf-8"))
    ]
    if page.stem == "cluster":
        found.sort(key=lambda words: words[1] in CLOSING)
    return [words for words in found if not _is_elsewhere(words)]


def _is_elsewhere(words: Sequence[str]) -> bool:
    if words[1] == "bridge":
        return "--data" in words
    return tuple(words[:2]) in ELSEWHERE


STORIES = [
    page
    for page in PAGES
    if page not in (EXAMPLES, ROOT / "README.md", ROOT / "CHANGELOG.md")
    and commands(page)
]
