"""Bugs put in by hand that once survived, as replacements of text that a file has once."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True, slots=True, kw_only=True)
class FixedMutant:
    """A bug: ``original`` text of a file, and the ``mutated`` text in its place.

    ``law`` is the test file that was written against it, which runs first.
    """

    name: str
    file: str
    law: str
    original: str
    mutated: str


# fmt: off
FIXED = (
    FixedMutant(
        name="scaling of a baseline taken from training and validation",
        file="diagnose/baselines/nearest_spectrum.py",
        law="tests/unit/diagnose/leaks/test_poisoned_subsets.py",
        original='scale = input_scale(sets["train"])',
        mutated="scale = np.mean("
        '[input_scale(sets[part]) for part in ("train", "validation")], axis=0)',
    ),
    FixedMutant(
        name="indicator model chosen on the test units",
        file="diagnose/studies/baseline_runs.py",
        law="tests/unit/diagnose/leaks/test_poisoned_subsets.py",
        original="baseline.fit(parts.train, parts.validation,",
        mutated="baseline.fit(parts.train, parts.test,",
    ),
    FixedMutant(
        name="indicator model fitted on training and test",
        file="diagnose/studies/baseline_runs.py",
        law="tests/unit/diagnose/leaks/test_canary_units.py",
        original="    detail = baseline.fit(parts.train,",
        mutated="    leaky = Parts(train=parts.train, validation=parts.train, test=parts.test)\n"
        "    detail = baseline.fit(leaky.judged(),",
    ),
    FixedMutant(
        name="novelty scaler fitted on all subsets",
        file="diagnose/studies/novelty.py",
        law="tests/unit/diagnose/leaks/test_poisoned_subsets.py",
        original=".fit(train.values[:, kept])",
        mutated=".fit(np.concatenate([part.values[:, kept] for part in tables.values()]))",
    ),
    FixedMutant(
        name="crack growth that forgets how often the wheel meshes",
        file="gensig/life/crack_growth.py",
        law="tests/physics/life/test_life_laws.py",
        original="grown * self.meshes",
        mutated="grown",
    ),
    FixedMutant(
        name="sign of a neighbouring mesh's torque reaction",
        file="gensig/sensing/nuisance.py",
        law="tests/unit/sensing/test_nuisance.py",
        original="along[2] = -self.base_radius",
        mutated="along[2] = self.base_radius",
    ),
    FixedMutant(
        name="sign of the wheel's profile slope as drawn",
        file="gensig/sensing/manufacturing.py",
        law="tests/unit/sensing/test_manufacturing.py",
        original="towards_tip = -1.0",
        mutated="towards_tip = 1.0",
    ),
    FixedMutant(
        name="damping of an accelerometer's resonance",
        file="gensig/sensing/accelerometer.py",
        law="tests/unit/sensing/test_accelerometer.py",
        original="2j * self.resonance_damping_ratio",
        mutated="1j * self.resonance_damping_ratio",
    ),
    FixedMutant(
        name="sidebands counted on one side only",
        file="gensig/signals/indicators.py",
        law="tests/unit/signals/test_gear_indicators.py",
        original="np.concatenate([-steps, steps])",
        mutated="steps",
    ),
)
# fmt: on
