"""Features of Hugging Face `datasets`: in the schema of a Parquet file and in a card.

The package `datasets` is not needed. It reads JSON from the metadata ``huggingface`` of an Arrow
schema, and YAML from the front matter of a card. Needs the package pyarrow.
"""

import json
from collections.abc import Sequence
from typing import Any

import pyarrow

Feature = dict[str, Any]  # the JSON of one feature, with its kind under ``_type``
ANY_LENGTH = -1
NUMBERS = {"float": "float32", "double": "float64"}  # Arrow's name -> that of numpy


def schema_features(
    schema: pyarrow.Schema, class_column: str, class_names: Sequence[str]
) -> dict[str, Feature]:
    """Features of the columns of a schema by name.

    Parameters
    ----------
    schema : of strings, numbers and lists of them
    class_column : name of the column of class numbers, int64
    class_names : of class 0, 1, ...
    """
    features = {field.name: _feature(field.type) for field in schema}
    features[class_column] = {"names": list(class_names), "_type": "ClassLabel"}
    return features


def _feature(kind: pyarrow.DataType) -> Feature:
    if pyarrow.types.is_fixed_size_list(kind):
        inner = _feature(kind.value_type)
        return {"feature": inner, "length": kind.list_size, "_type": "List"}
    if pyarrow.types.is_list(kind):
        inner = _feature(kind.value_type)
        return {"feature": inner, "length": ANY_LENGTH, "_type": "List"}
    name = str(kind)
    return {"dtype": NUMBERS.get(name, name), "_type": "Value"}


def schema_note(features: dict[str, Feature]) -> str:
    """Metadata ``huggingface`` of a schema with these features."""
    return json.dumps({"info": {"features": features}})


def card_features(features: dict[str, Feature]) -> list[dict[str, Any]]:
    """Features as the front matter of a card lists them."""
    return [
        {"name": name, **_card_feature(feature)} for name, feature in features.items()
    ]


def _card_feature(feature: Feature) -> dict[str, Any]:
    if feature["_type"] == "ClassLabel":
        names = {str(number): name for number, name in enumerate(feature["names"])}
        return {"dtype": {"class_label": {"names": names}}}
    if feature["_type"] == "Value":
        return {"dtype": feature["dtype"]}
    inner = _card_feature(feature["feature"])
    content: dict[str, Any] = {"list": inner.get("dtype", inner)}
    if feature["length"] != ANY_LENGTH:
        content["length"] = feature["length"]
    return content
