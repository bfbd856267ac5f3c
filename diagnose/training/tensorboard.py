"""What TensorBoard can show of a study.

Losses epoch by epoch while it runs, and the scores at its end.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from gensig.errors import ConfigError

FOLDER = "tensorboard"
SCORES = ("balanced_accuracy", "macro_f1")

OnEpoch = Callable[[int, float, float], None]


def need_tensorboard() -> None:
    """Refuse to go on without the package of the extra ``tensorboard``."""
    try:
        import torch.utils.tensorboard  # noqa: F401
    except ImportError:
        raise ConfigError(
            "tensorboard=true needs the package tensorboard: pip install 'gensig[tensorboard]', or leave it false"
        ) from None


@contextmanager
def epoch_log(out: str | Path, name: str, *, wanted: bool) -> Iterator[OnEpoch]:
    """What `diagnose.training.train.train_network` calls after each epoch; it writes below
    ``out/tensorboard/<name>``.

    Parameters
    ----------
    out : folder of the study
    name : of the training, one folder each
    wanted : whether anything is written
    """
    if not wanted:
        yield lambda epoch, training, validation: None
        return
    from torch.utils.tensorboard import SummaryWriter

    with SummaryWriter(str(Path(out) / FOLDER / name)) as writer:

        def on_epoch(epoch: int, training: float, validation: float) -> None:
            writer.add_scalar("loss/training_windows", training, epoch)
            writer.add_scalar("loss/validation_records", validation, epoch)
            writer.flush()

        yield on_epoch


def write_scores(out: str | Path, protocols: Mapping[str, Any]) -> None:
    """Scores of every method, each protocol as a folder below ``out/tensorboard/scores``.

    Parameters
    ----------
    protocols : the part ``protocols`` of ``metrics.json``
    """
    from torch.utils.tensorboard import SummaryWriter

    for protocol, result in protocols.items():
        with SummaryWriter(str(Path(out) / FOLDER / "scores" / protocol)) as writer:
            for method, scores in result.get("methods", {}).items():
                for name in SCORES:
                    score = scores.get(name)
                    parts = {"mean": score} if isinstance(score, float) else score or {}
                    for part in ("mean", "low", "high"):
                        if parts.get(part) is not None:
                            writer.add_scalar(f"{name}/{method}/{part}", parts[part], 0)
