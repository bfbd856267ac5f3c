"""croissant.json: MLCommons Croissant 1.0, with the Responsible-AI fields."""

import json
from collections.abc import Sequence
from typing import Any

import numpy as np

from gensig.dataset.cards.facts import kind_of_machine
from gensig.dataset.cards.origin import origin_of
from gensig.dataset.columns import COLUMNS
from gensig.dataset.folder.layout import MANIFEST, PLAN, SHARDS, SPLITS
from gensig.dataset.plan import Plan
from gensig.dataset.reader import Dataset
from gensig.dataset.schema import PARAMS
from gensig.text.escaping import plain

_TERMS = (
    "citeAs",
    "column",
    "equivalentProperty",
    "extract",
    "field",
    "fileObject",
    "fileProperty",
    "fileSet",
    "format",
    "includes",
    "isLiveDataset",
    "jsonPath",
    "key",
    "md5",
    "parentField",
    "path",
    "recordSet",
    "references",
    "regex",
    "repeated",
    "replace",
    "samplingRate",
    "separator",
    "source",
    "subField",
    "transform",
)
_CONTEXT: dict[str, Any] = {
    "@language": "en",
    "@vocab": "https://schema.org/",
    "conformsTo": "dct:conformsTo",
    "cr": "http://mlcommons.org/croissant/",
    "data": {"@id": "cr:data", "@type": "@json"},
    "dataType": {"@id": "cr:dataType", "@type": "@vocab"},
    "dct": "http://purl.org/dc/terms/",
    "examples": {"@id": "cr:examples", "@type": "@json"},
    "rai": "http://mlcommons.org/croissant/RAI/",
    "sc": "https://schema.org/",
}
_CONTEXT |= {term: f"cr:{term}" for term in _TERMS}
_TYPES = {"U": "sc:Text", "i": "sc:Integer", "f": "sc:Float"}


def croissant_text(data: Dataset, caveats: Sequence[str]) -> str:
    """The description as JSON-LD: facts from the manifest, the plan and the shards.

    `caveats` as limitations.
    """
    manifest, origin = data.manifest, origin_of(data.manifest)
    name = plain(data.folder.resolve().name)
    facts = (
        f"{data.n_records} records of {data.n_samples} samples at {data.sampling_rate:g} Hz, "
        f"{len(data.channel_names)} channels, classes {', '.join(data.class_names)}"
    )
    content: dict[str, Any] = {
        "@context": dict(sorted(_CONTEXT.items())),
        "@type": "sc:Dataset",
        "conformsTo": [
            "http://mlcommons.org/croissant/1.0",
            "http://mlcommons.org/croissant/RAI/1.0",
        ],
        "name": name,
        "description": (
            f"{origin.made} by gensig {manifest.generator_version}: {facts}."
        ),
        "license": origin.license_address,
        "version": "1.0.0",
        "keywords": ["vibration", "gear", "fault diagnosis", origin.tags[0]],
        "isLiveDataset": False,
        "citeAs": (
            f"{name}: {origin.kind}, gensig {manifest.generator_version}, "
            f"{manifest.identity[:16]}"
        ),
        "datePublished": str(manifest.environment.get("created", ""))[:10]
        or "1970-01-01",
        **_responsible_ai(data, facts, caveats),
        **origin.responsible,
        "distribution": _distribution(data),
        "recordSet": [_plan_records(data.plan)],
    }
    return json.dumps(content, indent=1, ensure_ascii=False) + "\n"


def _responsible_ai(
    data: Dataset, facts: str, caveats: Sequence[str]
) -> dict[str, Any]:
    """Fields on the origin of the data and the limits of their use."""
    of_examples = data.column("label_name")[~data.is_reference]
    names, counts = np.unique(of_examples, return_counts=True)
    pairs = zip(names.tolist(), counts.tolist(), strict=True)
    classes = ", ".join(f"{name} {count}" for name, count in pairs)
    failed = int(np.count_nonzero(~data.usable))
    return {
        "rai:dataCollection": (
            "Simulated from physics; nothing was measured. config.yaml and plan.csv hold every "
            "parameter; gensig makes the same bytes from them again (seed "
            f"{data.manifest.seed})."
        ),
        "rai:dataCollectionType": ["Software Collection", "Others: physics simulation"],
        "rai:dataCollectionRawData": facts,
        "rai:dataAnnotationProtocol": (
            "Labels are the inputs of the simulation, not judgements: each record states the "
            "fault that was put into its gear, its size and its tooth."
        ),
        "rai:dataPreprocessingProtocol": [
            "Integrated at a multiple of the sampling rate, low-passed and decimated; noise "
            "added at the stated ratio."
        ],
        "rai:dataLimitations": list(caveats),
        "rai:dataBiases": [
            f"Records per class: {classes}; real machines are nearly always healthy.",
            f"{kind_of_machine(data)}, "
            f"{len(np.unique(data.column('unit_id')))} machines drawn from assumed scatter.",
            f"{failed} records failed and are marked so.",
        ],
        "rai:dataUseCases": [
            "Developing and comparing methods of gear-fault diagnosis under known truth.",
            "Not validated: deciding on a real machine with a model trained on these records "
            "alone.",
        ],
        "rai:dataSocialImpact": (
            "A model that was never tried on measured signals may miss a dangerous fault."
        ),
        "rai:personalSensitiveInformation": [
            "None: no person, place or machine of anyone is in the data."
        ],
        "rai:dataReleaseMaintenancePlan": (
            "Never changed once complete: manifest.json holds the sha256 of every file."
        ),
    }


def _distribution(data: Dataset) -> list[dict[str, Any]]:
    def file(name: str, kind: str, digest: str) -> dict[str, Any]:
        return {
            "@type": "cr:FileObject",
            "@id": name,
            "name": name,
            "contentUrl": name,
            "encodingFormat": kind,
            "sha256": digest,
        }

    files = data.manifest.files
    tables = [name for name in files if name == PLAN or name.startswith(f"{SPLITS}/")]
    shards = [
        file(f"{SHARDS}/{entry.name}", "application/x-hdf5", entry.sha256)
        for entry in data.manifest.shards
        if entry.state == "done"
    ]
    return [*(file(name, "text/csv", files[name]) for name in tables), *shards]


def _plan_records(plan: Plan) -> dict[str, Any]:
    """Record set of the plan: inputs of each record.

    The shards, as HDF5, Croissant can list but not read.
    """
    fields = []
    for name, values in plan.columns.items():
        identifier = f"records/{name.replace('/', '.')}"
        fields.append(
            {
                "@type": "cr:Field",
                "@id": identifier,
                "name": identifier,
                "description": _meaning(name),
                "dataType": _TYPES[values.dtype.kind],
                "source": {"fileObject": {"@id": PLAN}, "extract": {"column": name}},
            }
        )
    return {
        "@type": "cr:RecordSet",
        "@id": "records",
        "name": "records",
        "description": (
            f"One row a record of {PLAN}: labels and inputs. Its signals are in row `row` of "
            f"{SHARDS}/shard-<shard>.h5, and {MANIFEST} lists those files."
        ),
        "key": {"@id": "records/record_id"},
        "field": fields,
    }


def _meaning(name: str) -> str:
    if name in COLUMNS:
        column = COLUMNS[name]
        return column.description + f" ({column.unit})" * (column.unit not in ("", "1"))
    if name in ("shard", "row"):
        return f"{name} that holds the record, counted from 0"
    if name.startswith(f"{PARAMS}/"):
        return "drawn or swept value, unit in the name"
    return "input of the simulation"
