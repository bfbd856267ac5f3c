"""The recorded overrides of a data set of a stranger are texts, and nothing else."""

import pytest
from refusals import refused

from gensig.dataset.folder.layout import OVERRIDES, read_overrides
from gensig.errors import DatasetError

BOMB = "- &a [x]\n" + "".join(
    f"- &{name} [{', '.join([f'*{before}'] * 10)}]\n"
    for before, name in zip("abcdefghi", "bcdefghij", strict=True)
)


@pytest.mark.parametrize(
    ("text", "message"),
    [
        (BOMB, "uses YAML aliases"),
        (f"- {'[' * 60}{']' * 60}\n", "is nested deeper than 50 levels"),
        ("- !!python/object/apply:os.system [x]\n", "is no plain YAML"),
        ("- [seed=1]\n", "is no list of texts"),
        ("seed: 1\n", "is no list of texts"),
        ("", "is no list of texts"),
    ],
)
def test_what_is_no_list_of_texts_is_refused(text, message, tmp_path):
    (tmp_path / OVERRIDES).write_text(text)
    with refused(message, DatasetError):
        read_overrides(tmp_path)


def test_words_come_back_as_they_were_typed(tmp_path):
    words = ["seed=1", "plan.classes=[healthy, crack]", "3"]
    (tmp_path / OVERRIDES).write_text(
        "- seed=1\n- plan.classes=[healthy, crack]\n- '3'\n"
    )
    assert read_overrides(tmp_path) == words
