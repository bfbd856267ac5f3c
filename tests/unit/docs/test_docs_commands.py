"""Every command that a page shows can be typed: verb and flags parse, overrides compose."""

import argparse
import functools
from collections.abc import Collection, Sequence
from pathlib import Path
from typing import Any

import pytest
from docs_pages import NAMES, PAGES, command_lines

import diagnose.cli
import gensig.cli
from gensig.errors import ConfigError
from gensig.options.compose import compose, override_keys, sweep
from gensig.plan.request import read_request
from tests import figures
from tests.screenshots import SHOTS

MAIN = {"gensig": gensig.cli.main, "diagnose": diagnose.cli.main}


class _Parsed(Exception):
    """Carries the parsed words of a verb out before the verb runs."""


@pytest.fixture
def stopped_after_parsing(monkeypatch: pytest.MonkeyPatch) -> None:
    def stopping(name: str) -> Any:
        known = getattr(argparse.ArgumentParser, name.replace("parse_", "parse_known_"))

        def parse(
            parser: argparse.ArgumentParser,
            words: Sequence[str] | None = None,
            namespace: Any = None,
        ) -> Any:
            result, left = known(parser, words, namespace)
            if left:
                parser.error(f"unrecognized arguments: {' '.join(left)}")
            raise _Parsed(result)

        return parse

    for name in ("parse_args", "parse_intermixed_args"):
        monkeypatch.setattr(argparse.ArgumentParser, name, stopping(name))


@functools.cache
def _compose(verb: str, job: tuple[str, ...]) -> None:
    """Compose as the verb would; keys of a fault go into each class, one composition each."""
    if verb == "train":
        compose("train", [*job, "data=DIR", "out=DIR"])
    elif any(word.startswith(("fault.", "plan.vary")) for word in job):
        read_request(job)
    else:
        compose("generate", job)


def _check(words: list[str], own: Collection[str] = ()) -> None:
    """Raise ConfigError where a command is none.

    ``own`` are names of options that earlier commands of the page write into ./configs.
    """
    if "--help" in words or words[-1] == "--version":
        return
    try:
        MAIN[words[0]](words[1:])
    except _Parsed as parsed:
        arguments = parsed.args[0]
    else:
        raise ConfigError("nothing was parsed")
    overrides = [word for word in getattr(arguments, "overrides", ()) if "=" in word]
    for job in sweep(overrides):
        names = {word.partition("=")[2] for word in job}
        is_own = getattr(arguments, "config_dir", None) or names.intersection(own)
        if is_own or words[1] == "evaluate":
            override_keys(
                job
            )  # options of the user's own, which are not here; keys that are no configuration
        else:
            _compose(words[1], tuple(job))


@pytest.mark.parametrize("page", PAGES, ids=NAMES)
def test_commands_of_a_page_can_be_typed(
    page: Path, stopped_after_parsing: None
) -> None:
    wrong, own = [], set()
    for line, words in command_lines(page.read_text(encoding="utf-8")):
        if words[:3] == ["gensig", "new", "gearbox"]:
            own.add(words[3])
        try:
            _check(words, own)
        except ConfigError as error:
            wrong.append(f"line {line}: {' '.join(words)}: {error}")
    assert not wrong, "\n".join(wrong)


def test_every_picture_is_drawn_by_a_command_that_can_be_typed(
    stopped_after_parsing: None,
) -> None:
    drawn = figures.commands()
    made_otherwise = {"realism_recording.png", "realism_yardstick.png", *SHOTS}
    files = {
        str(path.relative_to(figures.FOLDER)) for path in figures.FOLDER.rglob("*.png")
    }
    assert drawn.keys() | made_otherwise == files
    for name, words in drawn.items():
        _check(words)
        assert name in words or words[:2] == ["gensig", "figures"]


@pytest.mark.parametrize(
    "command",
    [
        "gensig gnerate experiment=quickstart",
        "gensig stiffness --plott crack.png",
        "gensig simulate fault=crak",
        "gensig plan mesh.damping=0.1",
        "diagnose train protocols=[by_unit] epoch=3",
        "diagnose predict --model",
    ],
)
def test_a_mistake_would_be_found(command: str, stopped_after_parsing: None) -> None:
    with pytest.raises(ConfigError):
        _check(command.split())


def test_there_are_commands_to_check() -> None:
    n_commands = sum(
        len(list(command_lines(page.read_text(encoding="utf-8")))) for page in PAGES
    )
    assert n_commands > 100
