"""All verbs of the command ``gensig``, in the groups and the order of its help."""

from gensig.commands.machine_verbs import MACHINE_VERBS
from gensig.commands.set_verbs import OTHER_VERBS, SET_VERBS

KNOWN = {**SET_VERBS, **MACHINE_VERBS, **OTHER_VERBS}
GROUPS = {
    "data sets": (
        "options",
        "plan",
        "generate",
        "resume",
        "finalize",
        "verify",
        "reproduce",
        "inspect",
        "report",
        "export",
        "implant",
        "completion",
    ),
    "gears": (
        "stiffness",
        "transmission-error",
        "modify-flank",
        "root-stress",
        "wear-life",
        "figures",
        "validate",
    ),
    "machines": (
        "new",
        "twin",
        "measured",
        "simulate",
        "run-up",
        "modes",
        "forced-response",
        "tune-damper",
    ),
}
VERBS = {name: KNOWN[name] for names in GROUPS.values() for name in names}
