"""Gain of a fault: what it adds to a record, times a factor.

A law of domain randomisation, not physics: the size of a fault's mark is what a simulation tells
least well about a machine, and a training over many sizes does not rely on it. Domain
randomisation: Tobin et al. (2017), "Domain randomization for transferring deep neural networks
from simulation to the real world", IROS.
"""

from __future__ import annotations

from dataclasses import replace

from gensig.errors import SimulationError
from gensig.record.inputs import RecordInputs
from gensig.systems.run import CleanRecord

Motion = CleanRecord | SimulationError


def needs_sound(inputs: RecordInputs) -> bool:
    """True for a faulty record whose fault has another gain than 1."""
    return bool(inputs.run.faults) and inputs.machine.sensing.fault_gain != 1.0


def with_fault_gain(inputs: RecordInputs, motion: Motion, sound: Motion) -> Motion:
    """The motion with what its faults add to the accelerations times the gain of the sensing.

    Accelerations are ``sound + gain (motion - sound)`` at the bearings, before transfer path,
    sensors and noise; path and sensors are linear up to the converter. Shaft angle, speed, loads
    of the teeth and accuracy stay those of the simulation. A healthy record, and any at gain 1, is
    returned as it is.

    Parameters
    ----------
    inputs : of the record
    motion, sound : of the record and of the same record without its faults; an error where one
        failed, which is then the result
    """
    if not needs_sound(inputs) or isinstance(motion, SimulationError):
        return motion
    if isinstance(sound, SimulationError):
        return sound
    gain = inputs.machine.sensing.fault_gain
    residual = motion.acceleration - sound.acceleration
    return replace(motion, acceleration=sound.acceleration + gain * residual)
