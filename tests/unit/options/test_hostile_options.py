"""Option files, words and stored configurations of strangers: refused in one line, never run."""

import os
import re
import subprocess
import sys

import pytest
import yaml
from docs_pages import ROOT
from refusals import refused

from gensig.cli import main
from gensig.dataset.folder.beginning import config_text
from gensig.errors import ConfigError
from gensig.options.compose import compose
from gensig.options.files import option_keys
from gensig.options.plain_file import MOST_BYTES, check_option
from gensig.options.references import MOST_DEPTH
from gensig.plan.request import read_request

SECRET = "a value of the environment"
VARIABLE = "SECRET_OF_THIS_TEST"
LEVELS = range(1, 12)


def bomb(first, level):
    """Ten times the level before, in each of some levels."""
    lines = [f"a0: &a0 {first}"]
    lines += [
        f"a{number}: &a{number} {level.format(*[f'*a{number - 1}'] * 10)}"
        for number in LEVELS
    ]
    return "\n".join(lines) + "\n"


def referring(value):
    """Ten references to the level before, in each of some levels."""
    lines = ["a0: [x]"]
    lines += [f"a{n}: {value(f'${{operating.a{n - 1}}}')}" for n in LEVELS]
    return "\n".join(lines) + "\n"


LIST = "[{}, {}, {}, {}, {}, {}, {}, {}, {}, {}]"
MAPPING = "{{a: {}, b: {}, c: {}, d: {}, e: {}, f: {}, g: {}, h: {}, i: {}, j: {}}}"
MERGED = "{{<<: [{}, {}, {}, {}, {}, {}, {}, {}, {}, {}]}}"
TOO_MANY = "stands for more than 20000 values"
NESTED = f"is nested in more than {MOST_DEPTH} levels"
NO_KEY = "is no reference to a key; allowed are ${key} and ${oc.select:key,value}"
HOME = f"${{oc.env:{VARIABLE}}}"
LEADS_OUT = "leads out of the options"

ATTACKS = {
    "lists of lists": (bomb("[x]", LIST), TOO_MANY),
    "mappings of mappings": (bomb("{x: 1}", MAPPING), TOO_MANY),
    "merged mappings": (bomb("{x: 1}", MERGED), TOO_MANY),
    "a long text by many names": (
        f"a: &a {'x' * 100_000}\nb: [{', '.join(['*a'] * 30)}]\n",
        "stands for more than 2000000 characters",
    ),
    "an alias of itself": ("a: &a [*a]\n", "alias *a stands for itself or nothing"),
    "deep lists": (f"a: {'[' * 500}{']' * 500}\n", NESTED),
    "very deep lists": (f"a: {'[' * 200_000}\n", NESTED),
    "deep by aliases": (
        "a: &a " + "[" * 30 + "]" * 30 + "\nb: " + "[" * 30 + "*a" + "]" * 30 + "\n",
        NESTED,
    ),
    "a large file": (f"a: 1 # {'x' * MOST_BYTES}\n", "is larger than 1 MB"),
    "many values": (f"a: [{'1,' * 30_000}]\n", TOO_MANY),
    "references in lists": (
        referring(lambda text: f"[{', '.join([repr(text)] * 10)}]"),
        TOO_MANY,
    ),
    "references in texts": (
        referring(lambda text: f"'{text * 10}'").replace("[x]", "x" * 100),
        "stands for more than",
    ),
    "references to a reference's part": (
        "a: {b: {c: 1}}\nd: ${operating.d.b}\n",
        "refers to itself",
    ),
    "a reference to itself": ("a: ${operating.a}\n", "operating.a refers to itself"),
    "a reference around itself": ("a: {b: '${operating.a}'}\n", "refers to itself"),
    "an object": (
        "a: !!python/object/apply:os.system ['touch ran']\n",
        "the tag 'tag:yaml.org,2002:python/object/apply:os.system' is refused",
    ),
    "a name": ("a: !!python/name:os.system\n", "is refused"),
    "a path": ("a: !!python/object/apply:pathlib.Path [x]\n", "is refused"),
    "a tag of its own": ("a: !Ref x\n", "the tag '!Ref' is refused"),
    "a binary": ("a: !!binary aGVsbG8=\n", "is refused"),
    "a target": (
        "a:\n  _target_: os.system\n  _args_: [touch ran]\n",
        "the key _target_ is refused",
    ),
    "a deep target": (
        "a: [{b: {_target_: os.system}}]\n",
        "the key _target_ is refused",
    ),
    "a dotted target": ("a._target_: os.system\n", "the key _target_ is refused"),
    "the environment": (f"a: {HOME}\n", NO_KEY),
    "the environment in a list": (f"a: [1, {{b: '{HOME}'}}]\n", NO_KEY),
    "the environment in a text": (f"a: 'x {HOME} y'\n", NO_KEY),
    "the environment as a default": (f"a: '${{oc.select:none,{HOME}}}'\n", NO_KEY),
    "the environment by parts": ("b: env\na: '${oc.${operating.b}:HOME}'\n", NO_KEY),
    "the environment in a key": (f"'{HOME}': 1\n", NO_KEY),
    "the environment by an alias": (f"a: &a '{HOME}'\nb: *a\n", NO_KEY),
    "an escaped reference": (f"a: '\\{HOME}'\n", NO_KEY),
    "a decoded text": ("a: '${oc.decode:x}'\n", NO_KEY),
    "a created value": ("a: '${oc.create:x}'\n", NO_KEY),
    "keys of a mapping": ("a: '${oc.dict.keys:operating}'\n", NO_KEY),
    "a deprecated key": ("a: '${oc.deprecated:seed}'\n", NO_KEY),
    "hydra's folder": ("a: '${hydra:runtime.cwd}'\n", NO_KEY),
    "hydra's clock": ("a: '${now:%Y}'\n", NO_KEY),
    "a reference that is joined": (
        f"a: '$'\nb: '${{operating.a}}{HOME[1:]}'\n",
        "holds values, not references",
    ),
    "the environment in a choice": (f"defaults: [{{gear: '{HOME}'}}]\n", LEADS_OUT),
    "another folder": ("defaults: [../../outside]\n", LEADS_OUT),
    "another folder of a group": ("defaults: [{override /gear: ../../x}]\n", LEADS_OUT),
    "an absolute path": ("defaults: [//tmp/outside]\n", LEADS_OUT),
    "another source": ("defaults: ['file://tmp/outside']\n", LEADS_OUT),
    "a package": ("defaults: ['pkg://os']\n", LEADS_OUT),
    "a home": ("defaults: [~/outside]\n", LEADS_OUT),
    "a launcher": (
        "defaults: [{override /hydra/launcher: basic}]\n",
        "is a setting of Hydra itself",
    ),
    "hydra's keys": (
        "# @package _global_\nhydra: {run: {dir: x}}\n",
        "sets keys of Hydra itself",
    ),
    "hydra's package": (
        "# @package hydra.job\nname: x\n",
        "puts its keys into 'hydra.job'",
    ),
    "a key twice": ("a: 1\na: 2\n", "found duplicate key a"),
    "two documents": ("a: 1\n---\na: 2\n", "is no YAML"),
    "no mapping": ("- 1\n", "is no mapping"),
    "a list as a key": ("? [a]\n: 1\n", "a key must be a text"),
    "a number as a key": ("a: {1: 2}\n", "must be a text; quote it"),
    "a very long number": (f"a: {'9' * 100_000}\n", "a number of 100000 digits"),
    "a very long time": (f"a: 1{':59' * 1000}\n", "a number of 3001 digits"),
    "bytes": (b"a: \xff\xfe\n", "is no text in UTF-8"),
    "a null": ("a: \0\n", "is no YAML"),
}
# refused where Hydra composes; the listing of keys neither resolves nor composes
COMPOSED_ALONE = {name for name in ATTACKS if "refer" in name} | {
    "a key twice",
    "a number as a key",
}
COMPOSED_ALONE -= {"an escaped reference"}


@pytest.fixture
def folder(tmp_path, monkeypatch):
    monkeypatch.setenv(VARIABLE, SECRET)
    monkeypatch.chdir(tmp_path)
    (tmp_path / "mine" / "operating").mkdir(parents=True)
    (tmp_path / "outside.yaml").write_text("speed_rpm: 666\n")
    return tmp_path / "mine"


def write(folder, content):
    data = content
    if isinstance(content, str):
        data = content.encode()
    file = folder / "operating" / "theirs.yaml"
    file.write_bytes(data)
    return file


def theirs(folder):
    return read_request(["operating=theirs"], config_dir=folder)


@pytest.mark.parametrize("name", ATTACKS)
def test_a_file_that_is_more_than_values_is_refused(name, folder):
    content, message = ATTACKS[name]
    file = write(folder, content)
    with refused(message) as caught:
        theirs(folder)
    assert SECRET not in str(caught.value)
    assert len(str(caught.value)) < 600
    if name not in COMPOSED_ALONE:
        assert file.name in str(caught.value)
        with refused(message):
            option_keys("operating", "theirs", folder)
    assert not (folder.parent / "ran").exists()


def doubling(folder, entry):
    """Options that each build on the one before twice."""
    group = folder / "operating"
    (group / "b0.yaml").write_text("speed_rpm: 1\n")
    for n in range(1, 12):
        entries = f"{entry.format(n=n - 1, key='p')}, {entry.format(n=n - 1, key='q')}"
        (group / f"b{n}.yaml").write_text(f"defaults: [{entries}]\n")


CHAINS = {
    "twice": ("b{n}@{key}", "builds on more than 100 options"),
    "twice by a path": ("/operating/b{n}@{key}", "builds on more than 100 options"),
    "twice by a group": (
        "{{/operating@{key}: b{n}}}",
        "builds on more than 100 options",
    ),
    "twice, a list": (
        "{{/operating@{key}: [b{n}]}}",
        "builds on more than 100 options",
    ),
}


@pytest.mark.parametrize("name", CHAINS)
def test_options_that_build_on_each_other_twice_are_refused(name, folder):
    entry, message = CHAINS[name]
    doubling(folder, entry)
    with refused(message):
        read_request(["operating=b11"], config_dir=folder)
    with refused(message):
        option_keys("operating", "b11", folder)


@pytest.mark.parametrize(
    "text",
    ["[theirs]", "[theirs@a]", "[{/operating@a: theirs}]", "[/operating/theirs@a]"],
)
def test_an_option_that_builds_on_itself_is_refused(text, folder):
    write(folder, f"defaults: {text}\n")
    with refused("builds on itself"):
        theirs(folder)
    with refused("builds on itself"):
        option_keys("operating", "theirs", folder)


def test_an_option_of_a_few_others_is_composed(folder):
    doubling(folder, "b{n}")
    write(folder, "defaults: [rated, b0, _self_]\ntorque_nm: 3\n")
    config = theirs(folder).config
    assert config["operating"]["speed_rpm"] == 1
    assert config["operating"]["torque_nm"] == 3


@pytest.mark.parametrize("place", ["mine", "configs"])
@pytest.mark.parametrize(
    "name", ["mappings of mappings", "an object", "a target", "the environment"]
)
def test_the_command_answers_in_one_line(name, place, folder, capsys):
    """By ``--config-dir`` and from ./configs alike."""
    content, message = ATTACKS[name]
    write(folder, content)
    words = ["plan", "operating=theirs", "--config-dir", "mine"]
    if place == "configs":
        folder.rename("configs")
        del words[2:]
    assert main(words) == 2
    shown = capsys.readouterr()
    (line,) = shown.err.splitlines()
    assert message in line
    assert shown.out == ""


def test_the_process_stays_small_and_quick(folder):
    """Ten to the power of eleven values in a process that may have one gigabyte."""
    write(folder, bomb("[x]", LIST))
    limit = "import resource as r; r.setrlimit(r.RLIMIT_AS, (4 << 30, 4 << 30))"
    code = f"{limit}; from gensig.cli import main; raise SystemExit(main())"
    words = ["plan", "operating=theirs", "--config-dir", str(folder)]
    result = subprocess.run(
        [sys.executable, "-c", code, *words], capture_output=True, text=True
    )
    assert result.returncode == 2, result.stderr
    assert TOO_MANY in result.stderr


@pytest.mark.parametrize(
    ("group", "option"),
    [("operating", "../../outside"), ("operating", "/outside"), ("..", "outside")],
)
def test_an_option_outside_of_the_folder_is_not_found(group, option, folder):
    with pytest.raises(ConfigError):
        option_keys(group, option, folder)
    with pytest.raises(ConfigError):
        read_request([f"{group}={option}"], config_dir=folder)


def test_a_class_of_a_plan_is_no_path(folder):
    (folder.parent / "outside.yaml").write_text("kind: crack\n")
    with refused(LEADS_OUT):
        read_request(["plan.classes=[../../outside]"], config_dir=folder)


def test_a_link_out_of_the_folder_is_refused(folder):
    file = folder / "operating" / "theirs.yaml"
    file.symlink_to(folder.parent / "outside.yaml")
    with refused("leads out of"):
        theirs(folder)
    file.unlink()
    (folder / "other.yaml").write_text("defaults: [rated]\nspeed_rpm: 600\n")
    file.symlink_to(folder / "other.yaml")
    config = theirs(folder).config
    assert config["operating"]["speed_rpm"] == 600


def test_what_is_no_file_is_not_waited_for(folder):
    os.mkfifo(folder / "operating" / "theirs.yaml")
    with pytest.raises(ConfigError, match=r"^[^\n]+$"):
        theirs(folder)


WORDS = [
    (f"operating.speed_rpm={HOME}", NO_KEY),
    (f"operating.speed_rpm='{HOME}'", NO_KEY),
    (f"operating.speed_rpm=$\\{{oc.env:{VARIABLE}\\}}", NO_KEY),
    (f"operating.speed_rpm=[1,{HOME}]", NO_KEY),
    (f"operating={{speed_rpm: {HOME}}}", NO_KEY),
    (f"+a='{HOME}'", NO_KEY),
    (f"plan.vary={{a: {HOME}}}", NO_KEY),
    (f"fault.crack_depth_mm='{HOME}'", NO_KEY),
    ("operating.speed_rpm='${hydra:runtime.cwd}'", NO_KEY),
    ("operating.speed_rpm='${oc.decode:x}'", NO_KEY),
    (f"gear='{HOME}'", NO_KEY),
    ("gear=../../outside", LEADS_OUT),
    ("gear=[../../outside]", "gear"),
    ("+a._target_=os.system", "the key _target_ is refused"),
    ("+a={b: {_target_: os.system}}", "the key _target_ is refused"),
    ("hydra.searchpath=[pkg://os]", "is a setting of Hydra itself"),
    ("hydra.run.dir=x", "is a setting of Hydra itself"),
    ("+hydra/launcher=basic", "is a setting of Hydra itself"),
    ("+gear@hydra.job=xiamen_23_84", "is a setting of Hydra itself"),
    (f"+a={'[' * 200}{']' * 200}", "nested deeper than 40 levels"),
    (f"+a={'x' * 200_000}", "longer than 100000 characters"),
    ("+a={b: '${a}'}", "refers to itself"),
]


@pytest.mark.parametrize(("word", "message"), WORDS)
@pytest.mark.parametrize("config_dir", [None, "mine"])
def test_a_word_that_is_more_than_a_value_is_refused(word, message, config_dir, folder):
    with refused(message) as caught:
        read_request([word], config_dir=config_dir)
    assert SECRET not in str(caught.value)
    with pytest.raises(ConfigError):
        compose("generate", [word], config_dir=config_dir)


STORED = [
    (["seed"], HOME, "holds values, not references"),
    (["gear", "name"], "${hydra:runtime.cwd}", "holds values, not references"),
    (["classes", "healthy", "kind"], HOME, "holds values, not references"),
    (["gear", "_target_"], "os.system", "the key _target_ is refused"),
    (["classes", "healthy", "_target_"], "os.system", "the key _target_ is refused"),
]


@pytest.mark.parametrize(("keys", "value", "message"), STORED)
def test_a_stored_configuration_holds_values_alone(keys, value, message, folder):
    content = read_request(["plan.classes=[healthy,crack]"]).config.plain()
    file = folder / "config.yaml"
    file.write_text(config_text(content | {"out": None}))
    read_request([], stored=file)
    node = yaml.safe_load(file.read_text())
    changed = node
    for key in keys[:-1]:
        node = node[key]
    node[keys[-1]] = value
    file.write_text(yaml.safe_dump(changed))
    with refused(message):
        read_request([], stored=file)


@pytest.mark.parametrize(("word", "message"), WORDS[:4])
def test_words_on_a_stored_configuration_are_checked(word, message, folder):
    content = read_request([]).config.plain()
    file = folder / "config.yaml"
    file.write_text(config_text(content | {"out": None}))
    with refused(message):
        read_request([word], stored=file)


ALLOWED = {
    "speed_rpm: ${gear.rated_speed_rpm}": 1800,
    "speed_rpm: ${oc.select:gear.rated_speed_rpm}": 1800,
    "speed_rpm: ${oc.select:gear.none, 7.5}": 7.5,
    "speed_rpm: ${.other}\nother: 3": 3,
    "speed_rpm: ${operating.other[1]}\nother: [1, 2]": 2,
    "other: &a [1, 2]\nmore: *a\nspeed_rpm: 5": 5,
}


@pytest.mark.parametrize("text", ALLOWED)
def test_references_to_keys_and_aliases_are_allowed(text, folder):
    write(folder, f"defaults: [rated, _self_]\n{text}\n")
    config = compose("generate", ["operating=theirs"], config_dir=folder)
    assert config["operating"]["speed_rpm"] == ALLOWED[text]


@pytest.mark.parametrize(
    "path", sorted((ROOT / "configs").rglob("*.yaml")), ids=lambda path: path.stem
)
def test_every_shipped_option_passes_the_checks_of_a_stranger(path):
    check_option(path, path.read_text(encoding="utf-8"))


def test_shipped_options_are_the_same_from_a_folder_of_a_user(folder):
    """The same files by the package's door and by the checked one."""
    pattern = re.compile(r"\$\{")
    files = [
        path
        for path in (ROOT / "configs").glob("*/*.yaml")
        if pattern.search(path.read_text()) and path.parent.name != "heat"
    ]
    assert len(files) >= 4
    for path in files:
        group = path.parent.name
        (folder / group).mkdir(exist_ok=True)
        (folder / group / "copy.yaml").write_text(path.read_text())
        if group == "system":
            continue  # its references need an excitation of its own
        words = ["system=two_stage_gearbox"]
        if path.stem == "machine":
            words = []
        shipped = compose("generate", [*words, f"{group}={path.stem}"])
        copied = compose("generate", [*words, f"{group}=copy"], config_dir=folder)
        assert copied.plain() == shipped.plain()


@pytest.mark.parametrize("name", ["a, b [c] (d)=e", "früher mine", "a:b"])
def test_a_folder_may_have_any_plain_name(name, folder):
    write(folder, "defaults: [rated, _self_]\nspeed_rpm: 600\n")
    renamed = folder.rename(folder.with_name(name))
    config = read_request(["operating=theirs"], config_dir=renamed).config
    assert config["operating"]["speed_rpm"] == 600


@pytest.mark.parametrize("name", [HOME, "a'b", "a\\b"])
def test_a_folder_whose_name_would_be_read_is_refused(name, folder):
    write(folder, "speed_rpm: 600\n")
    renamed = folder.rename(folder.with_name(name))
    with refused("cannot be used; rename it"):
        read_request(["operating=theirs"], config_dir=renamed)
