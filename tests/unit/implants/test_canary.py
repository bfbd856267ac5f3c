"""Nothing but the residual tells the classes of implants."""

import numpy as np
import pytest
from implant_samples import CARRIER_TEETH
from sklearn.ensemble import RandomForestClassifier
from sklearn.model_selection import GroupKFold, cross_val_predict

from gensig.implants.implanting import implant_records
from gensig.implants.options import ImplantOptions
from gensig.signals.indicators import crest_factor, kurtosis, rms

N_RECORDS = 240


def share_right(pairs, healthy, residual):
    """Share of records that a forest on indicators tells right, on blocks that it never saw."""
    options = ImplantOptions(
        n_records=N_RECORDS, path="none", duration=0.45, residual=residual
    )
    made = implant_records(
        pairs, healthy, teeth=CARRIER_TEETH, speed_rpm=900.0, options=options
    )
    signal = made.acceleration[:, 0].astype(float)
    bands = np.log(np.abs(np.fft.rfft(signal)[:, 1:1825]).reshape(N_RECORDS, 32, -1))
    features = np.column_stack(
        [rms(signal), kurtosis(signal), crest_factor(signal), bands.mean(axis=-1)]
    )
    forest = RandomForestClassifier(100, random_state=0, max_depth=4)
    answers = cross_val_predict(
        forest, features, made.label, groups=made.block, cv=GroupKFold(4)
    )
    return float(np.mean(answers == made.label))


def test_implants_of_nothing_are_told_by_chance(pairs, healthy):
    # of 240 records; carriers are the same in all classes, which makes less than chance likely
    assert share_right(pairs, healthy, "none") < 0.44


@pytest.mark.parametrize("residual", ["physics", "noise_bursts"])
def test_a_residual_tells_the_class(pairs, healthy, residual):
    assert share_right(pairs, healthy, residual) > 0.6
