"""A stored classifier: probabilities of a recording, scores on a data set, its graph."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any, Self, final

import numpy as np
from torch.nn.functional import log_softmax

from diagnose.data.targets import GEARS
from diagnose.data.turns import Turns
from diagnose.networks.calibration import calibration_scores, probabilities
from diagnose.networks.network import Network, SiteNetwork
from diagnose.recordings.prepared import PreparedRecording, tracking_text
from diagnose.recordings.source import Source
from diagnose.recordings.stored_network import (
    Answer,
    Graph,
    Scores,
    StoredNetwork,
    reliance,
    require_finite,
)
from diagnose.recordings.tooth_classifier import (
    TOOTH_KIND,
    ToothClassifier,
    load_tooth_classifier,
)
from diagnose.recordings.verdict import class_text, score_text, verdict
from diagnose.report.figures import confusion_figure
from diagnose.scoring.intervals import spread_text
from diagnose.scoring.judged import class_scores, judged_answers
from diagnose.scoring.metrics import over_records
from diagnose.studies.counts import n_different
from diagnose.studies.result_files import Content
from diagnose.training.classes import predict_windows
from diagnose.training.heads import fault_site, predict_heads
from diagnose.training.store import (
    ModelDescription,
    data_fingerprint,
    load_model,
    read_description,
)
from gensig.errors import ConfigError, DatasetError

if TYPE_CHECKING:
    from diagnose.data.inputs import NetworkInput
    from diagnose.data.windows import Segments, Task
    from gensig.dataset.reader import Dataset

NO_FLAG = "no out-of-distribution flag: the model stores none, train it again"
NO_FLAG_OF_TEETH = "of a speed and teeth of the training; its spectrum is not compared"


@final
@dataclass(frozen=True, slots=True, kw_only=True)
class StoredClassifier(StoredNetwork):
    """A network or a baseline that tells classes apart."""

    model: Network | ToothClassifier
    description: ModelDescription

    @classmethod
    def load(cls, folder: str | Path) -> Self:
        """Classifier of a folder."""
        description = read_description(folder)
        if description.model.get("kind") == TOOTH_KIND:
            return cls(model=load_tooth_classifier(folder), description=description)
        model, description = load_model(folder)
        return cls(model=model, description=description)

    def inputs(self) -> NetworkInput:
        """Kind of input that the network reads."""
        if self.description.model.get("kind") == TOOTH_KIND:
            return Turns.of(self.description.network)
        return StoredNetwork.inputs(self)

    def check(self, source: Source) -> None:
        """Refuse torque and age, which no classifier takes."""
        for name in ("torque_nm", "life_time_h"):
            if getattr(source, name) is not None:
                option = name.replace("_", "-")
                raise ConfigError(
                    f"--{option} is for models of remaining life; leave it out"
                )

    def answer(self, source: Source, prepared: PreparedRecording) -> Answer:
        """Class, probabilities, and severity and gear as far as the network has such heads."""
        description, windows = self.description, prepared.windows
        log_probability = predict_windows(self.model, windows)
        _, by_record = over_records(log_probability, windows.record)
        require_finite(class_probabilities=log_probability)
        overall = probabilities(by_record, description.temperature)[0]
        by_class = self._by_class(overall)
        heads = {}
        if isinstance(self.model, Network):
            heads = predict_heads(self.model, windows)
            require_finite(**heads)
        severity = gear = None
        if "severity" in heads:
            severity = float(heads["severity"][0, overall.argmax()])
        if "gear" in heads:
            gear = GEARS[int(heads["gear"][0].argmax())]
        tooth = tooth_share = None
        if isinstance(self.model, SiteNetwork):
            gear, tooth, tooth_share = fault_site(
                self.model, windows, int(overall.argmax())
            )
            require_finite(tooth=np.array(tooth_share))
        by_window = probabilities(log_probability)
        speeds = description.speed_rpm_range
        return Answer(
            record={
                **verdict(by_class, description.test_score),
                "probabilities": by_class,
                "severity": severity,
                "gear": gear,
                "tooth": tooth,
                "tooth_share": tooth_share,
            },
            windows=[{"probabilities": self._by_class(row)} for row in by_window],
            conditions={
                "adaptation": description.adaptation,
                "speed_rpm": source.speed_rpm,
            },
            training={"trained_speed_rpm": speeds and list(speeds)},
        )

    def _by_class(self, values: Any) -> dict[str, float]:
        """Class -> its value, from (class,)."""
        return dict(zip(self.description.class_names, values.tolist(), strict=True))

    def line(self, result: Content) -> str:
        """Classes, speed, and how far the model can be relied on."""
        text = f"{result['recording']}: {class_text(result)}"
        is_faulty = result["gear"] not in (None, "none")
        if result["severity"] is not None and is_faulty and not result["undecided"]:
            text += f", severity {result['severity']:.2f} on the {result['gear']}"
            if result["tooth"] is not None and result["tooth"] >= 0:
                text += f", tooth {result['tooth']} after the first in mesh"
        text += tracking_text(result["order_tracking"])
        flag = reliance(result, "the class")
        if result["out_of_distribution"]:
            return f"{text}; {flag}"
        if result["n_windows_beyond"] is None:
            flag = NO_FLAG
            if isinstance(self.model, ToothClassifier):
                flag = NO_FLAG_OF_TEETH
        return f"{text}; {flag}; {score_text(result)}"

    def classes_of(self, dataset: Dataset) -> tuple[str, ...]:
        """Classes of the training, which must be those of the data set unless it is the same."""
        known, offered = self.description.class_names, tuple(dataset.class_names)
        is_same = data_fingerprint(dataset) == self.description.data_fingerprint
        if set(known) - set(offered) or (set(offered) - set(known) and not is_same):
            raise DatasetError(
                f"{dataset.folder} does not fit the model: its classes are {', '.join(offered)}, "
                f"the model knows {', '.join(known)}"
            )
        return known

    def scores(self, task: Task, segments: Segments, part: str) -> Scores:
        """Scores by record with intervals over machines, confusion, recall and calibration."""
        description = self.description
        windows = self.inputs().load(task, segments)
        by_window = predict_windows(self.model, windows)
        require_finite(class_probabilities=by_window)
        record, log_probability = over_records(by_window, windows.record)
        calibration = calibration_scores(
            [log_probability], [task.labels()[record]], [description.temperature]
        )
        name, n_bootstrap = str(description.model.get("name")), description.n_bootstrap
        judged = judged_answers(task, name, record, log_probability[None])
        return Scores(
            counts={
                "n_records": int(record.size),
                "n_units": n_different(judged.unit),
            },
            method={},
            values={
                "resampled": judged.machines.counts(),
                "calibration": calibration,
                **class_scores(judged, task.class_names, n_bootstrap),
            },
            write=_write_confusion,
        )

    def lines(self, result: Content) -> list[str]:
        """Part, channels, both scores and the recall of each class."""
        lines = [
            f"{result['n_records']} records of {result['n_units']} machine(s): {result['part']}",
            f"channels {', '.join(result['channel_names'])}",
        ]
        for name in ("balanced_accuracy", "macro_f1"):
            mean = result[name]["mean"]
            spread = spread_text(result[name], result["resampled"], ".3f")
            lines.append(f"{name} {mean:.3f}, {spread}")
        for name, share in result["recall"].items():
            lines.append(f"recall {name} {share:.3f}")
        return lines

    def graph(self) -> Graph:
        """Windows in m/s^2 in, log-probabilities out."""
        description = self.description
        return Graph(
            answer=lambda model, windows: log_softmax(model(windows), dim=1),
            further={},
            output="log_probability",
            unit=1.0,
            unit_text="a log-probability",
            agreement="log-probabilities within {:.1g} of torch's",
            facts={
                "class_names": list(description.class_names),
                "temperature": description.temperature,
                "probability": "softmax over classes of the mean log_probability over the windows "
                "of a record / temperature",
            },
        )


def _write_confusion(folder: Path, result: dict[str, Any]) -> None:
    """Write ``confusion.png``."""
    title = f"{result['model']}, {result['part']}"
    path = folder / "confusion.png"
    confusion_figure(path, result["confusion"], result["class_names"], title)
