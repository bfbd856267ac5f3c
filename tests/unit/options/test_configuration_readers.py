"""A section of a configuration is read once: few modules and functions know a `Configuration`."""

import ast
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[3]
# The modules that may know a `Configuration`. All others take the values that a reader returned.
CONFIGURATION = {
    # compose it, and settle what follows from its plan
    "gensig/options/compose",
    "gensig/options/configuration",
    "gensig/plan/condition_courses",
    "gensig/plan/request",
    # read it: sections to typed values
    "diagnose/settings",
    "gensig/driveline/drive_line",
    "gensig/driveline/engine_dampers",
    "gensig/driveline/engine_line",
    "gensig/driveline/in_time",
    "gensig/driveline/reading",
    "gensig/record/inputs",
    "gensig/record/machines",
    "gensig/systems/registry",
    "gensig/systems/root_strength",
    "gensig/systems/wear",
    # verbs: questions on the machine of a configuration, and what hands it to them
    "gensig/commands/output",
    "gensig/commands/gears/flanks",
    "gensig/commands/gears/modify",
    "gensig/commands/gears/physics",
    "gensig/commands/gears/run_up_variants",
    "gensig/commands/gears/strength",
    "gensig/commands/gears/wear",
    "gensig/commands/lines/forced_response",
    "gensig/commands/lines/tune_damper",
    # take it from a caller or a folder, and give it to a reader
    "diagnose/commands/train",
    "diagnose/training/study_folder",
    "gensig/commands/gears/simulate",
    "gensig/commands/lines/modes",
    "gensig/commands/request",
    "gensig/plan/make",
    "gensig/production/fault_pairs",
    "gensig/production/folder",
    "gensig/production/reproduction",
    "gensig/production/shard_writing",
    "gensig/production/streaming",
    "gensig/twin/check",
}
MOST_SIGNATURES = 37  # functions that take or return one; a quarter of them are verbs


def names_it(node: ast.AST) -> bool:
    """True for code in which the class is named, an import or an attribute too."""
    return any(
        "Configuration" in (getattr(each, "id", ""), getattr(each, "attr", ""))
        or (isinstance(each, ast.alias) and each.name == "Configuration")
        for each in ast.walk(node)
    )


def signatures_with_it(text: str) -> list[str]:
    """Functions of a module that take a `Configuration` or return one."""
    result = []
    for node in ast.walk(ast.parse(text)):
        if isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef):
            signature = [node.args, *filter(None, [node.returns])]
            if any(map(names_it, signature)):
                result.append(node.name)
    return result


def test_a_configuration_is_known_to_readers_and_doors_alone() -> None:
    texts = {
        path.relative_to(ROOT).with_suffix("").as_posix(): path.read_text()
        for folder in ("gensig", "diagnose")
        for path in (ROOT / folder).rglob("*.py")
    }
    known = {name for name, text in texts.items() if names_it(ast.parse(text))}
    assert known == CONFIGURATION
    signatures = {name: signatures_with_it(text) for name, text in texts.items()}
    assert sum(map(len, signatures.values())) <= MOST_SIGNATURES, signatures


@pytest.mark.parametrize(
    "annotation",
    [
        "Configuration",
        "Configuration | None",
        "Sequence[Configuration]",
        "c.Configuration",
    ],
)
def test_a_signature_with_a_configuration_is_seen(annotation: str) -> None:
    for text in (f"def f(a: {annotation}): ...", f"def f(*, a=1) -> {annotation}: ..."):
        assert names_it(ast.parse(text))
        assert signatures_with_it(text) == ["f"]
    assert names_it(ast.parse("from gensig.options.configuration import Configuration"))
    assert (
        signatures_with_it("def f(a: Section) -> int:\n    return Configuration(a)")
        == []
    )
