"""All verbs of the command ``gensig``, in the order of its help."""

from gensig.commands.machine_verbs import MACHINE_VERBS
from gensig.commands.set_verbs import OTHER_VERBS, SET_VERBS

VERBS = {**SET_VERBS, **MACHINE_VERBS, **OTHER_VERBS}
