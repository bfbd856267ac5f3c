"""Networks of a bridge: trained on implants, asked about the recordings."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from diagnose.bridge.implanted_windows import Implanted
from diagnose.bridge.protocol import BridgeProtocol
from diagnose.data.windows import FloatArray, WindowSet
from diagnose.scoring.metrics import over_records
from diagnose.settings import TrainSettings, settings_from
from diagnose.training.classes import Classes, predict_windows, with_shuffled_labels
from diagnose.training.train import train_network
from gensig.measured.measured_set import LABELS
from gensig.options.compose import compose

SHUFFLE_STREAM = 7  # of random numbers, beside those of the training


def bridge_settings(protocol: BridgeProtocol) -> TrainSettings:
    """Settings of a training: those of ``diagnose train model=cnn`` with the protocol's."""
    words = (
        "data=none",
        "out=none",
        "model=cnn",
        f"epochs={protocol.epochs}",
        f"patience={protocol.patience}",
        "epoch_fraction=1",
        f"batch_size={protocol.batch_size}",
        f"normalise={protocol.normalise}",
        "device=cpu",
    )
    return settings_from(compose("train", words))


def with_shuffles(implants: Implanted, seed: int) -> Implanted:
    """The same windows with labels that tell nothing."""
    rng = np.random.default_rng([seed, SHUFFLE_STREAM])
    return replace(
        implants,
        train=with_shuffled_labels(implants.train, len(LABELS), rng),
        validation=with_shuffled_labels(implants.validation, len(LABELS), rng),
    )


def network_answers(
    implants: Implanted, judged: WindowSet, settings: TrainSettings, seed: int
) -> FloatArray:
    """(recording, class) log-probabilities of a network trained on implants.

    Raises
    ------
    SimulationError    for a training that diverges
    """
    training = train_network(
        implants.train,
        implants.validation,
        target=Classes(n_classes=len(LABELS)),
        settings=settings,
        seed=seed,
    )
    windows = predict_windows(training.model, judged)
    return over_records(windows, judged.record)[1]
