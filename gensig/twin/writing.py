"""Files of a fitted machine: options for ``--config-dir``, their tables, and a report."""

from __future__ import annotations

import json
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from gensig.errors import ConfigError
from gensig.signals.transfer.path_gain import minimum_phase
from gensig.text.csv_tables import header_line
from gensig.text.option_writing import is_option_name, option_lines
from gensig.twin.fitting import SOURCE_CHANNEL, Fit, oversampling

# Hz between the lines of the path's file; its gain is smooth over a sixth of an octave
PATH_STEP = 20.0
DEFAULT_OVERSAMPLING = 5  # solver.oversampling of configs/generate.yaml
PATH_FILE, NOISE_FILE = "path.csv", "noise.csv"


def option_name(out: Path) -> str:
    """Name of the options: that of the folder.

    Raises
    ------
    ConfigError    for a name that an option cannot have, and for a folder that holds anything
    """
    name = out.resolve().name
    if not is_option_name(name):
        raise ConfigError(
            f"--out {out}: its name becomes that of the options; use letters, digits, _ and -"
        )
    if out.exists() and (not out.is_dir() or any(out.iterdir())):
        raise ConfigError(f"--out {out} is there and not an empty folder; give another")
    return name


def write_options(
    out: Path,
    fitted: Fit,
    gear: Mapping[str, Any],
    remarks: Mapping[str, str],
    torque_nm: float,
    duration: float,
) -> None:
    """Write gear, sensing and experiment options and the tables of path and noise.

    Parameters
    ----------
    gear : the group ``gear`` with all its keys
    remarks : comment of a key, by its dotted name
    torque_nm : of the driving gear
    duration : s of a record
    """
    name = option_name(out)
    for group in ("gear", "sensing", "experiment"):
        (out / group).mkdir(parents=True, exist_ok=True)
    head = (
        "# Written by gensig twin; report.md beside this folder's options says what was fitted "
        "and what assumed.\n"
    )
    (out / "gear" / f"{name}.yaml").write_text(
        head + "\n".join(option_lines(gear, remarks)) + "\n", encoding="utf-8"
    )
    (out / "sensing" / f"{name}.yaml").write_text(
        head + _sensing(out, fitted), encoding="utf-8"
    )
    experiment = (
        "# @package _global_\n" + head + _experiment(name, fitted, torque_nm, duration)
    )
    (out / "experiment" / f"{name}.yaml").write_text(experiment, encoding="utf-8")
    _write_path(out / PATH_FILE, fitted)
    _write_noise(out / NOISE_FILE, fitted)


def _sensing(out: Path, fitted: Fit) -> str:
    snr = float(np.median(fitted.snr))
    offsets = ", ".join(f"{snr - sensor_snr:.2f}" for sensor_snr in fitted.snr)
    return f"""defaults:
  - bearing
  - _self_

sampling_rate_hz: {fitted.sampling_rate!r}   # of the recording
# where the fitted path begins: the driving gear's bearing, line of action
channels: [{SOURCE_CHANNEL}]
sensors: {json.dumps(fitted.sensors)}
gain_scatter: 0.0              # one machine
snr_db: {snr:.2f}              # fitted; the median sensor's

path:
  kind: measured
  file: {json.dumps(str(out.resolve() / PATH_FILE))}   # fitted

noise:
  offsets_db: [{offsets}]      # fitted
  parts:
    - {{kind: spectrum, share: 1.0, file: {json.dumps(str(out.resolve() / NOISE_FILE))}}}   # fitted
"""


def _experiment(name: str, fitted: Fit, torque_nm: float, duration: float) -> str:
    profile, remark = _drift(fitted)
    speed = fitted.motion.mesh_frequency
    steps = oversampling(fitted.sampling_rate, DEFAULT_OVERSAMPLING)
    return f"""# gensig generate --config-dir {name} experiment={name} out=...
defaults:
  - override /gear: {name}
  - override /sensing: {name}
  - _self_

operating:
  torque_nm: {torque_nm!r}     # given, or assumed: a healthy recording does not tell it
  duration_s: {duration!r}
  speed_profile: {profile}   # {remark}
quality:
  # fitted: {fitted.grade.low:.1f} to {fitted.grade.high:.1f}
  iso1328_grade: {fitted.grade.grade:.2f}
  support_stiffness_scatter: 0 # one machine
  support_damping_scatter: 0
solver:
  oversampling: {steps}              # the step of the default configuration
plan:
  n_records: 80
  n_units: 8                   # sets of gears of the fitted grade
  n_gearboxes: 1               # one machine
  classes: [healthy, crack, pitting, missing_tooth]
# mesh frequency that was found: {speed:.4f} Hz
"""


def _drift(fitted: Fit) -> tuple[str, str]:
    """``operating.speed_profile`` as YAML and what to say of it."""
    if fitted.drift is None or fitted.motion.correlation_time is None:
        return "null", "no drift to be seen; report.md says why"
    time = f"correlation_time_s: {fitted.motion.correlation_time:.3g}"
    walk = f"{{kind: random_walk, scatter: {fitted.drift:.3g}, {time}}}"
    return walk, "fitted; drawn anew for each condition"


def _write_path(file: Path, fitted: Fit) -> None:
    names, columns = ["frequency_hz"], []
    for sensor, gain in zip(fitted.sensors, fitted.gain, strict=True):
        frequency, response = minimum_phase(
            fitted.gain_frequency, gain, fitted.sampling_rate, PATH_STEP
        )
        columns += [response.real, response.imag]
        names += [
            f"{SOURCE_CHANNEL}_to_{sensor}_{part}" for part in ("real", "imaginary")
        ]
    np.savetxt(
        file,
        np.column_stack([frequency, *columns]),
        "%.9g",
        ",",
        header=header_line(names),
        comments="",
    )


def _write_noise(file: Path, fitted: Fit) -> None:
    table = np.column_stack([fitted.noise_frequency, *fitted.density])
    np.savetxt(
        file,
        table,
        "%.9g",
        ",",
        header=header_line(["frequency_hz", *fitted.sensors]),
        comments="",
    )
