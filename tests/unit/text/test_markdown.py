"""Pages as Markdown: parts in their order, and no text of anybody's file is markup."""

import pytest

from gensig.text.markdown import escape, page_text
from gensig.text.page import Section, Table


@pytest.mark.parametrize(
    ("text", "shown"),
    [
        ("n_teeth, é_é", "n_teeth, é_é"),
        ("_a_ __b__ c_", r"\_a\_ \_\_b\_\_ c\_"),
        ("a|b\nc", r"a\|b c"),
        ("<b>*`[x](y)`*", r"&lt;b&gt;\*\`\[x\](y)\`\*"),
        (3, "3"),
    ],
)
def test_text_is_no_markup(text, shown):
    assert escape(text) == shown


def test_parts_stand_in_their_order():
    section = Section(
        title="a*",
        text=["see `code`"],
        table=Table(head=["x|"], rows=[["y|"], [1]]),
        notes=[("term", "note"), ("", "another")],
        figures=[("a.png", "b*")],
        code="import gensig",
    )
    following = Section(title="", text=["goes on"])
    parts = page_text("t*", ["lead"], [section, following]).split("\n\n")
    assert parts == [
        r"# t\*",
        "lead",
        r"## a\*",
        "see `code`",
        "| x\\| |\n|---|\n| y\\| |\n| 1 |",
        "- **term**: note\n- another",
        r"![b\*](a.png)",
        "```python\nimport gensig\n```",
        "goes on\n",
    ]
