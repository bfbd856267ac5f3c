"""The Python of the example of docs/howto/your_drive_line.md."""

from docs_pages import ROOT, blocks

PAGE = "your_drive_line.md"
(PYTHON,) = (
    block.code
    for block in blocks((ROOT / "docs" / "howto" / PAGE).read_text(encoding="utf-8"))
    if block.language == "python" and "test_own_drive_line" in block.mark
)


def test_python_of_the_page_runs(capsys):
    exec(compile(PYTHON, PAGE, "exec"), {})
    assert capsys.readouterr().out.startswith("[")
