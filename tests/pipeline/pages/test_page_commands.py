"""Every command of a page runs, in the order of the page, on small sets and short trainings.

README.md runs in ``tests/pipeline/test_readme.py``.
"""

import pytest
from docs_pages import ROOT
from page_commands import ELSEWHERE, JUDGED_IN, STORIES, commands
from page_files import write_files_of


@pytest.mark.parametrize("page", STORIES, ids=lambda page: page.stem)
def test_commands_of_a_page_run(page, workshop):
    write_files_of(page.read_text(encoding="utf-8"))
    for words in commands(page):
        workshop.run(words)


def test_what_does_not_run_here_runs_elsewhere():
    for test in (*ELSEWHERE.values(), JUDGED_IN):
        assert (ROOT / test).is_file()


def test_a_command_that_fails_is_noticed(workshop):
    with pytest.raises(AssertionError, match="n_units"):
        workshop.run(["gensig", "plan", "plan.n_units=0"])
