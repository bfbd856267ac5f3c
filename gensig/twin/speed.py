"""Speed and drift of a machine's recording, from the lines of its gears."""

from __future__ import annotations

from gensig.dynamics.decimation import usable_band
from gensig.signals import mesh_motion
from gensig.signals.mesh_motion import Motion, Teeth
from gensig.signals.recording import Recording


def find_motion(recording: Recording, teeth: Teeth, speed_rpm: float) -> Motion:
    """Speed and its drift within the band that the twin has too.

    See `gensig.signals.mesh_motion.find_motion`.

    Raises
    ------
    ConfigError    where the recording is too short to fit or to check, or shows no mesh
    """
    return mesh_motion.find_motion(
        recording,
        teeth,
        speed_rpm,
        highest=usable_band(recording.sampling_rate)[1],
        options="--teeth, --speed and --rate",
        longer="as many again to check: record longer, or give another recording with --check",
    )
