"""Bugs put in by hand that once survived, as replacements of text that a file has once."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True, slots=True, kw_only=True)
class FixedMutant:
    """A bug: ``original`` text of a file, and the ``mutated`` text in its place."""

    name: str
    file: str
    original: str
    mutated: str


# fmt: off
FIXED = (
    FixedMutant(
        name="scaling of a baseline taken from training and validation",
        file="diagnose/baselines/nearest_spectrum.py",
        original='scale = input_scale(sets["train"])',
        mutated='scale = [max(a, b) for a, b in zip('
        'input_scale(sets["train"]), input_scale(sets["validation"]))]',
    ),
    FixedMutant(
        name="indicator model chosen on the test units",
        file="diagnose/studies/baseline_runs.py",
        original="baseline.fit(parts.train, parts.validation,",
        mutated="baseline.fit(parts.train, parts.test,",
    ),
    FixedMutant(
        name="indicator model fitted on training and test",
        file="diagnose/studies/baseline_runs.py",
        original="    detail = baseline.fit(parts.train,",
        mutated="    both = Parts(train=parts.train, validation=parts.train, test=parts.test)\n"
        "    detail = baseline.fit(both.judged() if not np.isin("
        "parts.train.record, parts.test.record).any() else parts.train,",
    ),
    FixedMutant(
        name="novelty scaler fitted on all subsets",
        file="diagnose/studies/novelty.py",
        original=".fit(train.values[:, kept])",
        mutated=".fit(np.concatenate([part.values[:, kept] for part in tables.values()]))",
    ),
    FixedMutant(
        name="crack growth that forgets how often the wheel meshes",
        file="gensig/life/crack_growth.py",
        original="grown * self.meshes",
        mutated="grown",
    ),
    FixedMutant(
        name="sign of a neighbouring mesh's torque reaction",
        file="gensig/sensing/nuisance.py",
        original="along[2] = -self.base_radius",
        mutated="along[2] = self.base_radius",
    ),
    FixedMutant(
        name="sign of the wheel's profile slope as drawn",
        file="gensig/sensing/manufacturing.py",
        original="towards_tip = -1.0",
        mutated="towards_tip = 1.0",
    ),
    FixedMutant(
        name="damping of an accelerometer's resonance",
        file="gensig/sensing/accelerometer.py",
        original="2j * self.resonance_damping_ratio",
        mutated="1j * self.resonance_damping_ratio",
    ),
    FixedMutant(
        name="sidebands counted on one side only",
        file="gensig/signals/indicators.py",
        original="np.concatenate([-steps, steps])",
        mutated="steps",
    ),
)
# fmt: on
