"""The verb validate where there are no rows."""

import gensig.commands.validate
from gensig.cli import main


def test_an_installed_package_asks_for_a_checkout(monkeypatch, tmp_path, capsys):
    monkeypatch.setattr(gensig.commands.validate, "ROWS", tmp_path)
    assert main(["validate"]) == 2
    (line,) = capsys.readouterr().err.splitlines()
    assert "in a checkout of gensig" in line
