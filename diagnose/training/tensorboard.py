"""Logs for TensorBoard: losses of each epoch during a study, and its final scores."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Any

from gensig.errors import ConfigError
from gensig.text.installation import install

if TYPE_CHECKING:
    from diagnose.training.train import OnEpoch

FOLDER = "tensorboard"
SCORES = ("balanced_accuracy", "macro_f1")


def need_tensorboard() -> None:
    """Raise ConfigError without the package of the extra ``tensorboard``."""
    try:
        import torch.utils.tensorboard  # noqa: F401
    except ImportError:
        raise ConfigError(
            f"tensorboard=true needs the package tensorboard: {install('tensorboard')}; or "
            "leave it false"
        ) from None


@contextmanager
def epoch_log(out: str | Path, name: str, *, wanted: bool) -> Iterator[OnEpoch]:
    """Yield the `on_epoch` of a training, which writes below ``out/tensorboard/<name>``.

    Parameters
    ----------
    out : folder of the study
    name : of the training, one folder each
    wanted : False for a function that writes nothing
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
                    parts = scores.get(name, {})
                    if isinstance(parts, float):
                        parts = {"mean": parts}
                    for part in ("mean", "low", "high"):
                        if parts.get(part) is not None:
                            writer.add_scalar(f"{name}/{method}/{part}", parts[part], 0)
