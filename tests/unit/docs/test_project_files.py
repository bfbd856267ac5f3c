"""Version, citation, licences and the first data card agree with the code."""

import re
import tomllib
from pathlib import Path

import yaml

from gensig.dataset.folder.manifest import identity_hash
from gensig.plan.request import read_request
from gensig.version import __version__

ROOT = Path(__file__).resolve().parents[3]
PROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))[
    "project"
]


def text(name: str) -> str:
    return (ROOT / name).read_text(encoding="utf-8")


def test_changelog_begins_with_this_version() -> None:
    versions = re.findall(r"^## \[(\S+)\] - (\S+)$", text("CHANGELOG.md"), re.M)
    numbers = [
        tuple(int(part) for part in version.split(".")) for version, _ in versions
    ]
    assert versions[0][0] == __version__
    assert numbers == sorted(numbers, reverse=True)
    sections = re.split(r"^## ", text("CHANGELOG.md"), flags=re.M)[
        1:-1
    ]  # the first version changed no bits
    assert all("**Bits: " in section for section in sections)


def test_citation_is_of_this_version() -> None:
    citation = yaml.safe_load(text("CITATION.cff"))
    assert {"cff-version", "message", "title", "authors"} <= set(
        citation
    )  # what the format requires
    assert citation["version"] == __version__
    assert citation["license"] == PROJECT["license"]
    assert citation["title"].startswith(PROJECT["name"])


def test_every_package_that_is_needed_has_its_licence_told() -> None:
    extras = PROJECT["optional-dependencies"]
    asked_for = re.findall(r"\w+", extras["all"][0])[1:]
    needed = [
        *PROJECT["dependencies"],
        *(line for extra in asked_for for line in extras[extra]),
    ]
    told = " ".join(re.findall(r"^\| (.*?) \|", text("THIRD-PARTY.md"), re.M))
    others = [line for line in needed if not line.startswith("gensig[")]
    names = {re.split(r"[<>=]", line)[0].lower() for line in others}
    assert names - set(re.split(r"[^\w-]+", told.lower())) == set()


def test_card_of_the_first_data_set_is_that_of_this_version() -> None:
    """A new key changes the identity, and the card has to follow."""
    identity = identity_hash(
        read_request(["experiment=quickstart"]).config.with_entries(out=None).plain(),
        __version__,
    )
    card = text("data_cards/quickstart.md")
    assert f"| identity | {identity} |" in card
    assert f"by gensig {__version__}." in card
    assert f"- gensig-{__version__}\n" in card
