"""Refusals of recordings whose turns cannot be where speed and tooth counts put them.

A network that reads turns answers for any cut of a signal, as sure of a wrong one as of a right
one.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from diagnose.data.windows import FloatArray
from diagnose.recordings.mesh_comb import MeshComb, mesh_comb
from gensig.errors import ConfigError

# Measured, see docs/howto/unknown_machine.md: right speeds and teeth give 0.57 and more where
# another mesh stands out that much, wrong teeth of one more or less 0.55 and less.
LEAST_SHARE = 0.5  # of the decades of the best other mesh
LEAST_ELSEWHERE = 6.0  # decades of the other mesh; noise reaches 2
LEAST_NEAR = 2.5  # decades of the stated mesh; noise reaches 0.7, steady records have 10 and more
MOST_DRIFT = (
    1.0  # teeth over a recording of unfollowed speed; right speeds give 0.2 and less
)
MOST_LEVEL_RATIO = (
    5.0  # records of one machine differ by 2.0 and less; g for m/s2 by 9.8
)


@dataclass(frozen=True, slots=True, kw_only=True)
class Statement:
    """Speed and tooth counts as stated, with the words for a message.

    Attributes
    ----------
    file : name of the recording
    speed_rpm : of the driving gear
    teeth : of the driving and the driven gear
    said : speed and tooth counts in words
    options : to check where they are wrong
    followed : True if the speed was followed, by mesh or tachometer
    can_follow : True if it could be, by the mesh
    """

    file: str
    speed_rpm: float
    teeth: tuple[int, int]
    said: str
    options: str
    followed: bool
    can_follow: bool = True

    @property
    def mesh_frequency(self) -> float:
        """Mesh frequency in Hz."""
        return self.speed_rpm / 60.0 * self.teeth[0]


def check_turns(duration: float, statement: Statement) -> None:
    """Refuse a recording in which a tooth of either gear never passes.

    Raises
    ------
    ConfigError    with the turns that there are and the length needed
    """
    passages = duration * statement.mesh_frequency
    most = max(statement.teeth)
    if passages < most:
        driving, driven = (passages / teeth for teeth in statement.teeth)
        raise ConfigError(
            f"{statement.file} is too short: {duration:.3g} s are {driving:.2g} turns of the "
            f"driving and {driven:.2g} of the driven gear, and every tooth must pass once; "
            f"record {most / statement.mesh_frequency:.3g} s or longer"
        )


def check_place(
    signal: FloatArray, sampling_rate: float, statement: Statement
) -> MeshComb:
    """Refuse a signal whose mesh stands elsewhere than stated; return its harmonics.

    Parameters
    ----------
    signal : (channel, sample)
    sampling_rate : Hz

    Raises
    ------
    ConfigError    with both places, and the tooth count or speed that would be right
    """
    stated = statement.mesh_frequency
    comb = mesh_comb(signal, sampling_rate, stated, max(statement.teeth))
    is_elsewhere = comb.near < LEAST_SHARE * comb.elsewhere
    if is_elsewhere and comb.elsewhere >= LEAST_ELSEWHERE:
        share = comb.elsewhere_frequency / stated
        raise ConfigError(
            f"{statement.file}: {statement.said} puts the mesh at {stated:.5g} Hz, but the "
            f"recording has one at {comb.elsewhere_frequency:.4g} Hz, as of "
            f"{share * statement.teeth[0]:.3g} teeth or {share * statement.speed_rpm:.4g} r/min: "
            f"check {statement.options}"
        )
    return comb


def check_mesh(signal: FloatArray, sampling_rate: float, statement: Statement) -> None:
    """Refuse a signal of constant speed whose mesh is not where it is stated.

    Parameters
    ----------
    signal : (channel, sample)    as the turns are cut from it
    sampling_rate : Hz

    Raises
    ------
    ConfigError    where the mesh stands elsewhere, nowhere or too far off for the teeth to stay in
        place over the recording
    """
    comb = check_place(signal, sampling_rate, statement)
    stated, (driving, driven) = statement.mesh_frequency, statement.teeth
    follow = (
        f"give --teeth {driving} {driven} without --as-recorded, to follow the speed"
    )
    if comb.near < LEAST_NEAR:
        remedy = f"check {statement.options}"
        if statement.can_follow and not statement.followed:
            remedy += f"; if the speed wanders, {follow}"
        raise ConfigError(
            f"{statement.file}: no sign of the mesh near {stated:.5g} Hz, where {statement.said} "
            f"puts it: {remedy}"
        )
    duration = signal.shape[-1] / sampling_rate
    drift = abs(comb.near_frequency - stated) * duration
    if not statement.followed and drift > MOST_DRIFT:
        remedy = f"say {comb.near_frequency / driving * 60.0:.5g} r/min"
        if statement.can_follow:
            remedy = f"{follow}, or {remedy}"
        raise ConfigError(
            f"{statement.file}: the mesh is at {comb.near_frequency:.5g} Hz, not at {stated:.5g} "
            f"Hz as of {statement.said}, so that the turns drift by {drift:.1f} teeth; {remedy}"
        )


def check_level(
    signal: FloatArray, sound: FloatArray, file: str, healthy_file: str
) -> None:
    """Refuse a healthy recording whose level is not that of the same machine and sensors.

    Parameters
    ----------
    signal, sound : (channel, sample) m/s2, of the recording and of the healthy one

    Raises
    ------
    ConfigError    with the ratio of the levels
    """
    levels = signal.std(axis=-1), sound.std(axis=-1)
    tiny = np.finfo(float).tiny
    decades = np.log10(np.maximum(levels[0], tiny) / np.maximum(levels[1], tiny))
    ratio = float(10.0 ** np.median(decades))
    if not 1.0 / MOST_LEVEL_RATIO <= ratio <= MOST_LEVEL_RATIO:
        raise ConfigError(
            f"{file} has {ratio:.3g} times the level of --healthy {healthy_file}; records of one "
            f"machine differ by at most {MOST_LEVEL_RATIO:g}: check machine, sensors and --unit"
        )
