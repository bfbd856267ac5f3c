"""Tables of judged records that tests of scores share."""

import numpy as np
from numpy.random import default_rng

from diagnose.scoring.detection_limit import detection
from diagnose.scoring.judged import Judged
from diagnose.scoring.machines import Machines


def judged_table(answers, truth, unit, method="cnn"):
    """Answers (seed, record, class) of units that share nothing."""
    machines = Machines.alone(int(unit.max()) + 1)
    return Judged(
        method=method, truth=truth, unit=unit, machines=machines, answers=answers
    )


def cracks_table(score, truth, unit):
    """Healthy records and cracks, (record,), with a detection score, (seed, record)."""
    score = np.atleast_2d(score)
    answers = np.stack([np.zeros_like(score), score], axis=-1)
    return judged_table(answers, truth, unit)


def found_cracks(judged, healthy_elsewhere, sizes, n_bootstrap):
    """Detection of cracks of some sizes."""
    return detection(
        judged,
        healthy_elsewhere,
        class_names=("healthy", "crack"),
        sizes={"crack": sizes},
        n_bootstrap=n_bootstrap,
        rng=default_rng(1),
    )
