"""Options of one's own in ./configs: read without being pointed to, and announced once."""

import shutil
import warnings

import pytest
from docs_pages import ROOT
from refusals import refused

import diagnose.cli
from gensig.cli import main
from gensig.options.compose import sweep
from gensig.options.files import user_folder
from gensig.options.own_options import OwnOptionsWarning
from gensig.plan.request import read_request

NOTE = (
    "gensig: note: ./configs is read for options of your own; "
    "--config-dir DIR names another folder"
)


@pytest.fixture
def own(tmp_path, monkeypatch):
    """./configs with a gear and a fault of one's own."""
    monkeypatch.chdir(tmp_path)
    folder = tmp_path / "configs"
    (folder / "gear").mkdir(parents=True)
    (folder / "fault").mkdir()
    (folder / "gear" / "mine.yaml").write_text(
        "# Ours.\ndefaults: [xiamen_23_84, _self_]\nbacklash_um: 77\n"
    )
    (folder / "fault" / "ours.yaml").write_text(
        "# Ours too.\ndefaults: [crack, _self_]\ncrack_depth_mm: 0.7\n"
    )
    return folder


def test_an_option_of_the_folder_is_that_of_config_dir(own):
    for words in (["gear=mine"], ["plan.classes=[healthy,ours]"], ["fault=ours"]):
        with pytest.warns(OwnOptionsWarning, match=r"^\./configs is read"):
            found = read_request(words).config
        given = read_request(words, config_dir="configs").config
        assert found == given
    assert found["fault"]["crack_depth_mm"] == 0.7


def test_the_folder_is_left_alone_where_the_package_suffices(own):
    (own / "gear" / "broken.yaml").write_text("name: [1\n")
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        assert read_request(["gear=xiamen_23_84"]).config["gear"]["backlash_um"] != 77


def test_an_edited_option_is_read_anew(own):
    with pytest.warns(OwnOptionsWarning):
        read_request(["plan.classes=[ours]"])
    file = own / "fault" / "ours.yaml"
    file.write_text(file.read_text().replace("0.7", "0.9"))
    with pytest.warns(OwnOptionsWarning):
        config = read_request(["plan.classes=[ours]"]).config
    assert config["classes"]["ours"]["crack_depth_mm"] == 0.9


def test_a_slip_is_answered_with_ones_own_names(own):
    with refused("no option 'mien' of gear; did you mean 'mine'?"):
        read_request(["gear=mien"])
    with refused("'operating.speed_rpm'"):
        read_request(["operating.sped_rpm=3"])


def test_a_folder_that_is_named_is_read_alone(own, tmp_path):
    other = tmp_path / "other"
    other.mkdir()
    with refused("no option 'mine' of gear"):
        read_request(["gear=mine"], config_dir=other)


def test_glob_finds_ones_own_options(own):
    assert [job[0] for job in sweep(["gear=glob(m*)"])] == ["gear=mine"]


def test_each_command_announces_the_folder_once(own, capsys):
    words = ["stiffness", "gear=mine", "fault=ours"]
    assert main(words) == 0
    assert capsys.readouterr().err.count(NOTE) == 1
    assert main(["stiffness", "--config-dir", "configs", *words[1:]]) == 0
    assert NOTE not in capsys.readouterr().err
    assert main(["options", "gear"]) == 0
    listed = capsys.readouterr()
    assert "gear=mine" in listed.out
    assert listed.err.count(NOTE) == 1


def test_a_training_finds_a_model_of_ones_own(own, tmp_path, capsys):
    (own / "model").mkdir()
    (own / "model" / "my_net.yaml").write_text("# Ours.\ndefaults: [cnn, _self_]\n")
    words = ["train", "model=my_net", f"data={tmp_path / 'none'}", "out=x"]
    assert diagnose.cli.main(words) == 2
    note, mistake = capsys.readouterr().err.splitlines()
    assert note == NOTE.replace("gensig", "diagnose", 1)
    assert "none does not exist" in mistake
    assert diagnose.cli.main([*words, "model=my_nett"]) == 2
    assert "did you mean 'my_net'?" in capsys.readouterr().err


def test_a_checkout_is_no_folder_of_ones_own(own, tmp_path, monkeypatch):
    assert user_folder() is not None
    monkeypatch.chdir(ROOT)
    assert user_folder() is None
    checkout = tmp_path / "checkout"
    shutil.copytree(ROOT / "configs", checkout / "configs")
    monkeypatch.chdir(checkout)
    assert user_folder() is None


@pytest.mark.parametrize("files", [(), ("README.md",), ("database/local.yaml",)])
def test_a_folder_of_something_else_is_not_read(files, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "configs").mkdir()
    for name in files:
        file = tmp_path / "configs" / name
        file.parent.mkdir(exist_ok=True)
        file.write_text("a: 1\n")
    assert user_folder() is None
