"""A request on a stored configuration: nothing typed changes nothing, words go on top."""

import pytest
import yaml
from refusals import refused

from gensig.cli import main
from gensig.dataset.folder.beginning import config_text
from gensig.dataset.folder.manifest import identity_hash
from gensig.plan.make import make_plan
from gensig.plan.request import read_request

REQUESTS = {
    "default": (),
    "quickstart": ("experiment=quickstart", "fault.crack_depth_mm=1.2"),
    "realistic": ("experiment=realistic", "sensing.snr_db=20"),
    "a pinned course": ("operating=drifting", "operating.course_seed=7"),
    "a drawn course": ("operating=drifting",),
    "turns": ("operating.turns=12",),
    "lives": ("experiment=run_to_failure",),
    "many machines": ("experiment=many_machines", "gear.pinion.n_teeth=24"),
    "helical": ("experiment=helical",),
    "an engine": ("experiment=engine_test_point",),
    "no derived mass": ("gear=harbin_38_55", "gear.normal_module_mm=5"),
    "compound": (
        "fault=compound",
        "fault.parts=[{kind: crack, crack_depth_mm: 1}, {kind: wear, gear: wheel}]",
    ),
    "grid": (
        "plan.design=grid",
        "plan.n_records=null",
        "plan.vary={operating.speed_rpm: {distribution: choice, values: [900, 1200]}}",
        "plan.classes=[healthy,pitting]",
        "fault.vary={pit_width_mm: {distribution: uniform, low: 3, high: 5, levels: 2}}",
    ),
    "drawn gear": ("plan.fault_gear=drawn", "fault=crack"),
}


def identity(request):
    return identity_hash(request.config.with_entries(out=None).plain(), "1")


@pytest.fixture
def stored(tmp_path):
    """Function that writes the configuration of typed words, as a data set stores it."""

    def write(words):
        config = read_request(words).config.with_entries(out=None)
        file = tmp_path / "config.yaml"
        file.write_text(config_text(config.plain()))
        return file

    return write


@pytest.mark.filterwarnings("ignore::gensig.plan.request.DerivedValueWarning")
@pytest.mark.parametrize("name", REQUESTS)
def test_nothing_typed_changes_nothing(name, stored):
    file = stored(REQUESTS[name])
    again = read_request([], stored=file)
    assert identity(again) == identity(read_request(REQUESTS[name]))
    assert config_text(again.config.plain()) == file.read_text()
    assert again.overrides == (f"--config {file}",)


@pytest.mark.parametrize(
    "word",
    [
        "seed=9",
        "fault.crack_depth_mm=1.5",
        "fault.gear=wheel",
        "fault.vary={pit_width_mm: {distribution: uniform, low: 3, high: 5}}",
        "fault.vary={}",
        "operating.torque_nm=25",
        "plan.vary={operating.speed_rpm: {distribution: choice, values: [900]}}",
        "plan.vary={}",
        "plan.machines=crossed",
        "plan.classes=[healthy,wear,crack]",
        "sensing.channels=[pinion_y]",
        "gear.pinion.n_teeth=25",
        "material=steel",
        "modification=none",
        "fault=crack",
        "fault=missing_tooth",
        "executor.n_workers=3",
    ],
)
@pytest.mark.filterwarnings("ignore::gensig.plan.request.DerivedValueWarning")
def test_words_on_top_do_as_with_the_words_that_it_was_made_of(word, stored):
    first = ["experiment=quickstart", "sensing.snr_db=15"]
    file = stored(first)
    config = read_request([word], stored=file).config
    assert config.plain() == read_request([*first, word]).config.plain()


def test_a_typed_group_replaces_its_keys_alone(stored):
    file = stored(["operating.speed_rpm=999", "sensing.snr_db=11"])
    config = read_request(["gear=harbin_38_55"], stored=file).config
    assert config["gear"] == read_request(["gear=harbin_38_55"]).config["gear"]
    assert config["operating"]["speed_rpm"] == 999
    rated = read_request(["operating=rated"], stored=file).config
    assert rated["operating"]["speed_rpm"] == 1800
    assert rated["sensing"]["snr_db"] == 11


def test_an_option_brings_the_groups_that_it_chooses(stored):
    file = stored(["seed=3"])
    config = read_request(["system=two_stage_gearbox"], stored=file).config
    whole = read_request(["system=two_stage_gearbox", "seed=3"]).config
    assert config.plain() == whole.plain()
    make_plan(config)


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (["experiment=quickstart"], "leave out --config or experiment=quickstart"),
        (["operating.sped_rpm=3"], "did you mean 'operating.speed_rpm'"),
        (["fault=crakc"], "did you mean 'crack'?"),
        (["fault.pit_widht_mm=3"], "unknown key 'fault.pit_widht_mm'"),
        (["+a.b=3"], "type group=option or key=value"),
        (["~gear"], "type group=option or key=value"),
    ],
)
def test_words_that_do_not_fit_are_refused(words, message, stored):
    file = stored(["plan.classes=[healthy,crack]"])
    with refused(message):
        read_request(words, stored=file)


@pytest.mark.parametrize(
    ("content", "message"),
    [
        ("seed: 1\n", "has no group 'classes'"),
        ("- 1\n", "is no mapping"),
        ("a: !!python/object:os.system {}\n", "is no plain YAML"),
        ("a: &b 1\nclasses: {c: *b}\n", "uses YAML aliases"),
        ("classes: {}\nseed: '${oc.env:HOME}'\n", "holds values, not references"),
        ("classes: {}\nseed: 1\n", "must be a group of keys"),
    ],
)
def test_a_file_of_a_stranger_is_data(content, message, tmp_path):
    file = tmp_path / "config.yaml"
    file.write_text(content)
    with refused(message):
        read_request([], stored=file)


def test_a_file_without_keys_that_came_later_has_their_values(stored):
    file = stored(["plan.machines=crossed"])
    content = yaml.safe_load(file.read_text())
    assert "machines" not in content["plan"]
    config = read_request(["plan.machines=separate"], stored=file).config
    assert config["plan"]["machines"] == "separate"


def test_a_file_that_names_no_method_had_one_that_left(stored, capsys):
    file = stored([])
    content = yaml.safe_load(file.read_text())
    del content["solver"]["backend"]
    file.write_text(yaml.safe_dump(content))
    assert main(["plan", "--config", str(file)]) == 2
    (line,) = capsys.readouterr().err.splitlines()
    assert line.endswith("left with version 0.19; take solver.backend=nystroem")
    assert main(["plan", "--config", str(file), "solver.backend=nystroem"]) == 0


def test_a_missing_file_is_named(tmp_path):
    with refused(f"--config {tmp_path / 'none'} does not exist"):
        read_request([], stored=tmp_path / "none")
