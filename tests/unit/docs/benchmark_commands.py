"""Commands ``python -m benchmarks...`` of the pages, and the least that each can be asked for."""

import re
import shlex
from collections.abc import Iterator

from docs_pages import PAGES, ROOT

COMMAND = re.compile(r"python\s+-m\s+(benchmarks(?:\.\w+)?)([^`\n#;,|]*)")
# name -> words of the smallest run that passes through the whole command
QUICK = {
    "benchmarks": ("--quick",),
    "benchmarks.accuracy": ("--duration", "0.02", "--steps", "4"),
    "benchmarks.gearbox_levels": ("--quick",),
    "benchmarks.mutants": ("--stored",),
    "benchmarks.replay_rate": ("--quick",),
    "benchmarks.ross": ("--stored",),
    "benchmarks.same_signals": ("--quick",),
    "benchmarks.shaft_line": (
        *("--duration", "0.01", "--checked", "0.01", "--oversampling", "2"),
    ),
    "benchmarks.stages": ("--quick",),
    "benchmarks.stiffness_time": ("--contacts", "2", "--runs", "1"),
}
# name -> test that runs its parts: trainings and campaigns, of which the least takes minutes
IN_PARTS = {
    "benchmarks.bridge": "tests/pipeline/tools/test_bridge_tool.py",
    "benchmarks.detection": "tests/unit/diagnose/detection/test_detect_command.py",
    "benchmarks.fuzz_campaign": "tests/unit/dataset/test_fuzz.py",
    "benchmarks.general_model": "tests/unit/diagnose/recordings/test_shipped_network.py",
    "benchmarks.hostile_options": "tests/unit/options/test_wrong_shapes.py",
    "benchmarks.kill_campaign": "tests/pipeline/test_crash_safety.py",
    "benchmarks.machine_curve": "tests/unit/diagnose/scoring/test_machine_intervals.py",
    "benchmarks.model_campaign": "tests/unit/diagnose/recordings/test_strangers_models.py",
    "benchmarks.realism": "tests/pipeline/tools/test_realism_tool.py",
    "benchmarks.soak": "tests/pipeline/test_crash_safety.py",
}


INLINE = re.compile(r"(?<!`)`(?!`)[^`]+`(?!`)")


def named() -> Iterator[tuple[str, str, list[str]]]:
    """Page, module and words of every such command, in blocks and in text."""
    for page in PAGES:
        name = str(page.relative_to(ROOT))
        if name == "CHANGELOG.md":  # names commands that were
            continue
        text = page.read_text(encoding="utf-8")
        whole = INLINE.sub(lambda code: code[0].replace("\n", " "), text)
        for module, words in COMMAND.findall(whole):
            yield name, module, shlex.split(words)
