"""Network of a study: the one that is asked for, or the other one that its file names."""

from __future__ import annotations

from dataclasses import replace

from diagnose.data.turns import NO_REFERENCE
from diagnose.data.windows import IS_REFERENCE, Task, all_segments
from diagnose.networks.registry import OTHERWISE, completed, input_of, takes_reference
from diagnose.settings import TrainSettings
from diagnose.studies.result_files import network_name
from gensig.errors import ConfigError
from gensig.options.compose import compose
from gensig.options.configuration import Section

AUTO = "auto"  # of the setting `reference`
LIVES = "remaining lives are predicted from windows of time"


def settings_for(
    task: Task, settings: TrainSettings
) -> tuple[TrainSettings, str | None]:
    """Settings with what an open data set decides: windows, the network and its inputs.

    Returns
    -------
    settings, and a line where another network is trained than asked for, else None

    Raises
    ------
    ConfigError    for a data set that lacks what the network needs, if its file names no other
    """
    settings = replace(
        settings,
        window_samples=task.window_samples,
        stride_samples=task.stride_samples,
    )
    note, asked_for = None, settings.reference
    settings = replace(settings, reference=_reference(task, settings))
    if OTHERWISE in settings.model and (reason := _why_not(task, settings)):
        asked = network_name(settings)
        settings = replace(settings, model=_network_file(settings.model[OTHERWISE]))
        note = f"network {network_name(settings)} instead of {asked}: {reason}"
    settings = replace(settings, model=_completed(task, settings))
    if settings.reference == NO_REFERENCE or takes_reference(settings.model):
        return settings, note
    if asked_for != AUTO:
        raise ConfigError(
            f"reference={asked_for}: network {network_name(settings)} compares with no healthy "
            "record; model=tooth does"
        )
    return replace(settings, reference=NO_REFERENCE), note


def _reference(task: Task, settings: TrainSettings) -> str:
    """Kind of references that are used; for ``auto`` that of the data set, if it has any."""
    if settings.reference != AUTO:
        return settings.reference
    if IS_REFERENCE in task.dataset.column_names:
        return "other_condition"
    return NO_REFERENCE


def _completed(task: Task, settings: TrainSettings) -> Section:
    """Configuration of the network with its heads and the values that its input takes."""
    return completed(settings.model, task.dataset, settings.heads)


def _why_not(task: Task, settings: TrainSettings) -> str | None:
    """Reason why the network cannot be trained on the records of a task; None if it can."""
    if settings.task == "remaining_life":
        return LIVES
    try:
        inputs = input_of(_completed(task, settings))
        inputs.check(task, all_segments(task), network_name(settings))
    except ConfigError as error:
        return str(error)
    return None


def _network_file(name: str) -> Section:
    """Content of ``configs/model/<name>.yaml``.

    Raises
    ------
    ConfigError    for a name without a file
    """
    return compose("train", [f"model={name}", "data=.", "out=."]).section("model")
