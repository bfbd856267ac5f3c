"""Words of a figure, read from its panels."""

from typing import Any


def labels(panel: Any) -> list[str]:
    """Labels of the lines and bars of a panel, as its legend has them."""
    return list(panel.get_legend_handles_labels()[1])
