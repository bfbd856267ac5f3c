"""The results in docs/howto/realism.md: simulated records beside measured ranges."""

from validation.realism_section import realism_lines

from benchmarks._realism_results import write_results
from gensig.report.realism import compare


def test_section(measured, tmp_path):
    path = tmp_path / "results.csv"
    assert realism_lines(path) == []
    write_results(
        path,
        "a comparison",
        [
            compare(measured(), [1.5, 1.6]),
            compare(measured(id="recording.x", at="channels"), [9.0]),
            compare(measured(id="recording.x", at="width"), [9.0]),
        ],
    )
    lines = realism_lines(path)
    assert "Compared: a comparison" in lines
    assert any(
        line.startswith("| a.b, ms, here | 1 to 2 | 1.55 [") and "] | inside |" in line
        for line in lines
    )
    assert lines.index("### Yardstick") < lines.index("### A healthy recording")
    assert {line.count("|") for line in lines if line.startswith("| ")} == {5}
    assert "- simulated more than twice as wide: x." in lines
    write_results(path, "a comparison", [compare(measured(), [1.5])])
    assert "### A healthy recording" not in realism_lines(path)
