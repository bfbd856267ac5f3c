"""The frozen protocol of ``diagnose bridge``: every choice in one value, none of them by the data.

A change of a number is a new version.
"""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True, slots=True, kw_only=True)
class BridgeProtocol:
    """Choices of a bridge.

    Attributes
    ----------
    version : of these numbers; 0 for others than the frozen ones
    window_turns : turns of the slowest shaft in a window, at the slowest healthy recording
    record_windows : length of an implanted record in windows, so that windows start anywhere
    highest_rate : Hz    recordings of a higher rate are resampled to it
    most_seconds : s    of a recording that are used, from its begin
    held_out : share of the time blocks of each healthy recording, its last ones, that carry nothing
    gain_db : dB    ends of the uniform law of a residual's level over the carrier's
    plain_healthy : share of the healthy implants without a residual
    path : "none" or "twin", see `gensig.implants.options.ImplantOptions`
    n_records : implanted records of a training
    validation_every : one in so many carrying blocks is for early stopping
    normalise : of windows; "rms" takes their level away
    epochs, patience, batch_size : of a training
    seeds : of trainings; the implants of a seed are drawn anew
    wrong_teeth : factor on all teeth of the wrong gearbox; its mesh stays, its shafts turn faster
    n_bootstrap : resamples of an interval
    """

    version: int
    window_turns: float = 4.0
    record_windows: float = 1.25
    highest_rate: float = 12_800.0
    most_seconds: float = 20.0
    held_out: float = 0.25
    gain_db: tuple[float, float] = (-10.0, 10.0)
    plain_healthy: float = 0.5
    path: str = "none"
    n_records: int = 600
    validation_every: int = 5
    normalise: str = "rms"
    epochs: int = 20
    patience: int = 6
    batch_size: int = 32
    seeds: tuple[int, ...] = (0, 1, 2)
    wrong_teeth: float = 0.73
    n_bootstrap: int = 2000

    def rows(self) -> list[tuple[str, str]]:
        """The choices in words, for the page."""
        low, high = self.gain_db
        return [
            ("version", str(self.version)),
            (
                "window",
                f"{self.window_turns:g} turns of the slowest shaft, half of it overlaps",
            ),
            ("rate", f"as recorded, at most {self.highest_rate:g} Hz"),
            ("length", f"the first {self.most_seconds:g} s of a recording"),
            (
                "healthy recordings",
                f"cut into time blocks; the last {self.held_out:.0%} held out",
            ),
            (
                "implants",
                f"{self.n_records} records a training, of {self.record_windows:g} windows",
            ),
            (
                "gain",
                f"{low:g} to {high:g} dB over the carrier's RMS, for every class alike",
            ),
            (
                "healthy implants",
                f"{self.plain_healthy:.0%} of them without a residual",
            ),
            ("path", f"{self.path}"),
            ("network", f"cnn, windows normalised by {self.normalise}"),
            (
                "training",
                f"{self.epochs} epochs at most, patience {self.patience}, one carrying block in "
                f"{self.validation_every} for early stopping",
            ),
            ("seeds", ", ".join(map(str, self.seeds))),
            (
                "wrong gearbox",
                f"all teeth times {self.wrong_teeth:g}, the same mesh frequency",
            ),
            ("intervals", f"95 %, {self.n_bootstrap} resamples within each class"),
        ]


FROZEN = BridgeProtocol(version=2)
