"""Every verb of both commands, given names that steer a terminal: one escaped line, status 2."""

import h5py
import pytest

import diagnose.cli
import gensig.cli
from gensig.commands.verbs import VERBS
from gensig.text.escaping import escaped

STEERING = "\x1b[2K\r\x9b1m\u202e\u2028\u200b"
NAME = f"a{STEERING}b"
PROGRAMS = {
    "gensig": (gensig.cli.main, tuple(VERBS)),
    "diagnose": (diagnose.cli.main, tuple(diagnose.cli.VERBS)),
}
CASES = [
    (program, verb, word)
    for program, (_, verbs) in PROGRAMS.items()
    for verb in (NAME, *verbs)
    for word in (NAME, f"--{NAME}", f"fault={NAME}", f"{NAME}.yaml")
    if not (verb == "completion" and word != NAME)
]


def lines_of(capsys):
    printed = capsys.readouterr()
    return [*printed.out.split("\n"), *printed.err.split("\n")]


@pytest.mark.parametrize("program", PROGRAMS)
def test_no_verb_lets_a_name_steer_the_terminal(program, tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    main = PROGRAMS[program][0]
    for _, verb, word in [case for case in CASES if case[0] == program]:
        status = main([verb, word])
        lines = lines_of(capsys)
        steering = [line for line in lines if not line.isprintable()]
        assert not steering, (verb, word)
        assert status != 0 or verb in ("validate",), (verb, word)
    assert list(tmp_path.iterdir()) == []


def test_names_in_files_are_shown_escaped(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)  # a long path would be cut
    path = f"{NAME}.h5"
    with h5py.File(path, "w") as file:
        file.create_dataset(NAME, data=[1.0]).attrs[NAME] = NAME
        file.attrs["unit"] = NAME
    assert gensig.cli.main(["inspect", path]) == 0
    lines = lines_of(capsys)
    assert all(line.isprintable() for line in lines)
    assert sum(escaped(NAME) in line for line in lines) >= 2


def test_names_and_comments_of_options_are_shown_escaped(tmp_path, capsys):
    folder = tmp_path / "fault"
    folder.mkdir()
    (folder / f"{NAME}.yaml").write_text("# About\u202ecrack\nkind: crack\n")
    assert gensig.cli.main(["options", "fault", "--config-dir", str(tmp_path)]) == 0
    lines = lines_of(capsys)
    assert all(line.isprintable() for line in lines)
    assert any(escaped(NAME) in line for line in lines)
    assert any("About\\u202ecrack" in line for line in lines)
