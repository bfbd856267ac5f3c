"""Origin of a data set in words: simulated, or implants in recordings of somebody's machine."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from gensig.dataset.folder.joining import IMPLANTS
from gensig.dataset.folder.layout import Manifest


@dataclass(frozen=True, slots=True, kw_only=True)
class Origin:
    """Texts of a card that depend on where its samples are from.

    Attributes
    ----------
    made : how the records were made, before "by gensig VERSION"
    kind : the same in two words, for citations
    caveats : first of those of a card, as Markdown
    license_name, license_address, license_text : of the data
    tags : further tags of the hub
    responsible : fields of the Responsible-AI part of a Croissant description that differ
    """

    made: str
    kind: str
    caveats: tuple[str, ...]
    license_name: str
    license_address: str
    license_text: str
    tags: tuple[str, ...]
    responsible: Mapping[str, Any]


SIMULATED = Origin(
    made="Gear vibration, simulated and labelled",
    kind="simulated gear vibration",
    caveats=(
        "The records are simulated. A model trained on them alone has proved nothing about "
        "measured signals.",
    ),
    license_name="cc-by-4.0",
    license_address="https://creativecommons.org/licenses/by/4.0/",
    license_text=(
        "Data licence: CC BY 4.0 (https://creativecommons.org/licenses/by/4.0/): "
        "free to use, name the source."
    ),
    tags=("synthetic", "simulation"),
    responsible={},
)

IMPLANTED = Origin(
    made="Healthy recordings that carry residuals of simulated gear faults, made and labelled",
    kind="recordings with implanted gear faults",
    caveats=(
        "The records are healthy recordings of one machine plus residuals of simulated faults. "
        "No fault was measured.",
        "Never score a model on a stretch of a recording that carried: config.yaml lists the "
        "blocks that did, and those held out.",
        "The level of a residual is drawn (`params/implant_gain_db`). It says nothing of how "
        "loud a fault of the machine would be.",
    ),
    license_name="other",
    license_address="urn:gensig:licence-of-the-recordings",
    license_text=(
        "The recordings are those of whoever made them, and gensig knows no licence of theirs: "
        "ask before you pass this data set on."
    ),
    tags=("semi-synthetic",),
    responsible={
        "rai:dataCollection": (
            "Healthy recordings of a machine, plus residuals of simulated faults. config.yaml "
            "holds the sha256 of every recording, its blocks, and the identity of the simulated "
            "set; plan.csv every drawn value."
        ),
        "rai:dataCollectionType": [
            "Physical Data Collection",
            "Others: physics simulation",
        ],
        "rai:dataAnnotationProtocol": (
            "Labels are those of the simulated faults, by the number of teeth that they are on."
        ),
        "rai:dataPreprocessingProtocol": [
            "Residuals turn with the shaft of the recording, and are added at a drawn level over "
            "its RMS."
        ],
        "rai:personalSensitiveInformation": [
            "The recordings are of somebody's machine; gensig does not know whose."
        ],
    },
)


def origin_of(manifest: Manifest) -> Origin:
    """Texts for a data set."""
    if IMPLANTS in manifest.configuration:
        return IMPLANTED
    return SIMULATED
