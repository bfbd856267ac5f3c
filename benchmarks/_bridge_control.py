"""The negative control: two states of a measured gearbox that differ in how its sensors are
mounted, not in the gear.

The recordings are looked for in the folder ``$GENSIG_MEASURED`` and nowhere else. Networks are
trained on one channel of simulated gears of its teeth and speed, and judge all windows of both
states.
"""

from __future__ import annotations

import os
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from benchmarks._bridge_worlds import CROSSED
from benchmarks._realism_recording import VARIABLE
from diagnose.data.windows import HEALTHY, Segments, WindowSet, plan_windows
from diagnose.networks.domain import distances
from diagnose.training.classes import predict_windows
from diagnose.training.store import (
    ModelDescription,
    load_domain,
    load_model,
)
from gensig.cli import main as gensig_main
from gensig.errors import ConfigError
from gensig.systems.registry import SIDES

FloatArray = NDArray[np.floating]

NAME = "negative_control_*.npz"
RATE, TEETH, SPEED = (
    12800.0,
    ("32", "80"),
    "1800",
)  # of its description; the first stage
FOUND_SPEED = 1781.0  # r/min; what `gensig twin` finds
TORQUES = (
    3,
    28,
)  # N m; up to what the twin assumes as rated: what the loads are is not known
STATES = ("healthy", "broken_tooth")
LOADS = (0, 50, 90)  # %
SCORED = 3  # the channel in which both states have the same path; the others are only reported
TWIN_OF = "healthy__load50"
# Windows of 0.125 s as the default's at 51.2 kHz; the default network stays at chance on so
# little of one channel.
TRAINING = (
    "window_samples=1600",
    "stride_samples=1600",
    "model=cnn",
    "epochs=20",
    "epoch_fraction=1",
)
BLOCK = 2  # windows that are drawn together
N_BOOTSTRAP = 5000
CLASSES = ("healthy", "crack", "broken", "missing_tooth")


def find_control() -> Path | None:
    """The file, or None where there is none."""
    folder = os.environ.get(VARIABLE)
    files = sorted(Path(folder).glob(NAME)) if folder else []
    return files[0] if files else None


def training_sets(file: Path, twin: Path) -> dict[str, tuple[list[str], Path | None]]:
    """Name of each set that networks are trained on: its overrides, and the folder of options that
    they need.

    ``housings`` are gears of those teeth in housings drawn at random, nothing of them fitted;
    ``twin`` is the twin.

    Parameters
    ----------
    file : the recordings
    twin : folder of the twin's options, made where it is not there
    """
    if not twin.is_dir():
        words = [
            "--array",
            TWIN_OF,
            "--channels",
            f"channel_{SCORED}",
            "--rate",
            f"{RATE:g}",
        ]
        status = gensig_main(
            [
                "twin",
                str(file),
                *words,
                "--teeth",
                *TEETH,
                "--speed",
                SPEED,
                "--out",
                str(twin),
            ]
        )
        if status != 0:
            raise ConfigError(f"gensig twin ended with status {status}")
    torque = (
        "operating.torque_nm: "
        f"{{distribution: uniform, low: {TORQUES[0]}, high: {TORQUES[1]}}}"
    )
    common = [
        f"plan.classes=[{','.join(CLASSES)}]",
        "plan.n_records=320",
        "plan.n_units=40",
        "operating.duration_s=0.5",
    ]
    fitted = [f"experiment={twin.name}", *common, f"plan.vary={{{torque}}}"]
    housings = [
        "experiment=quickstart",
        "sensing=housing",
        *CROSSED,
        *common,
        "plan.n_gearboxes=20",
        f"plan.vary={{{torque}, sensing.snr_db: {{distribution: uniform, low: 10, high: 30}}}}",
        *(f"gear.{side}.n_teeth={n}" for side, n in zip(SIDES, TEETH, strict=True)),
        *(
            f"gear.{side}.{key}=null"
            for side in SIDES
            for key in ("mass_kg", "inertia_kg_m2")
        ),
        f"operating.speed_rpm={FOUND_SPEED:g}",
        f"sensing.sampling_rate_hz={RATE:g}",
        "sensing.sensors=[housing]",
        "sensing.path.natural_frequency_hz=[300,4800]",
        "sensing.noise.band_hz=[10,4900]",
        "solver.oversampling=20",
    ]
    return {"housings": (housings, None), "twin": (fitted, twin)}


def judge_control(file: Path, models: Sequence[Path]) -> list[dict[str, Any]]:
    """One row for each channel and load.

    How much more of a fault the broken state is said to have.
    """
    with np.load(file, allow_pickle=False) as held:
        recorded = {
            (state, load): held[f"{state}__load{load}"]
            for state in STATES
            for load in LOADS
        }
    n_channels = len(recorded[STATES[0], LOADS[0]])
    loaded = [
        (*load_model(folder), load_domain(folder, load_model(folder)[1]))
        for folder in models
    ]
    rng = np.random.default_rng(20240607)
    rows = []
    for channel in range(n_channels):
        result = [_judge(recorded, channel, *one) for one in loaded]
        for load in LOADS:
            fault, beyond = (
                {
                    state: np.mean([one[state, load][which] for one in result], axis=0)
                    for state in STATES
                }
                for which in (0, 1)
            )
            rows.append({"channel": channel, "load": load, **_row(fault, beyond, rng)})
    return rows


def _judge(
    recorded: dict[tuple[str, int], NDArray[Any]],
    channel: int,
    model: Any,
    description: ModelDescription,
    domain: Any,
) -> dict[tuple[str, int], tuple[FloatArray, FloatArray]]:
    """(state, load) -> probability of a fault and whether unlike the training, (window,) each, in
    the order of time.
    """
    healthy = description.class_names.index(HEALTHY)
    result = {}
    for key, signal in recorded.items():
        windows = _windows(signal[channel : channel + 1], description)
        said = 1.0 - np.exp(predict_windows(model, windows)[:, healthy])
        result[key] = said, distances(domain, windows) > domain.threshold
    return result


def _windows(signal: NDArray[Any], description: ModelDescription) -> WindowSet:
    whole = Segments(
        record=np.array([0]), start=np.array([0]), stop=np.array([signal.shape[-1]])
    )
    segment, start = plan_windows(
        whole, description.window_samples, description.stride_samples
    )
    return WindowSet(
        signals=(signal.astype(np.float32),),
        segment=segment,
        start=start,
        label=np.zeros_like(segment),
        record=np.zeros_like(segment),
        window_samples=description.window_samples,
        normalise=description.normalise,
    )


def _row(
    fault: dict[str, FloatArray],
    beyond: dict[str, FloatArray],
    rng: np.random.Generator,
) -> dict[str, Any]:
    """Difference of the mean probabilities with a 95 % interval by bootstrap over blocks of each
    recording.
    """
    drawn = {state: _block_means(values, rng) for state, values in fault.items()}
    sound, broken = (fault[state] for state in STATES)
    low, high = np.quantile(drawn[STATES[1]] - drawn[STATES[0]], [0.025, 0.975])
    share = {state: float(values.mean()) for state, values in beyond.items()}
    return {
        "n_windows": int(sound.size),
        "fault_if_healthy": float(sound.mean()),
        "fault_if_broken": float(broken.mean()),
        "difference": float(broken.mean() - sound.mean()),
        "interval": [float(low), float(high)],
        "contains_zero": bool(low <= 0.0 <= high),
        "beyond_if_healthy": share[STATES[0]],
        "beyond_if_broken": share[STATES[1]],
        "refuses_both": min(share.values()) >= 0.5,
    }


def _block_means(values: FloatArray, rng: np.random.Generator) -> FloatArray:
    """(draw,) means over blocks drawn again."""
    blocks = values[: values.size // BLOCK * BLOCK].reshape(-1, BLOCK).mean(axis=1)
    return blocks[rng.integers(blocks.size, size=(N_BOOTSTRAP, blocks.size))].mean(
        axis=1
    )
