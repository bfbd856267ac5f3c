"""The errors a user can cause.

Each says what was given, what is allowed and what to do, in one line.
"""


class GensigError(Exception):
    """Base of every error that is the user's to mend.

    Commands print it as one line and exit with status 2.
    """


class ConfigError(GensigError):
    """A configuration key, option or value that cannot be used."""


class TooShortError(ConfigError):
    """A recording that is too short for what is asked of it."""


class GeometryError(GensigError):
    """Gears that cannot exist or cannot mesh."""


class FaultError(GensigError):
    """A fault that does not fit the tooth it is put on."""


class ExtrapolationError(GensigError):
    """A fitted formula asked for beyond the range on which it was checked."""


class SimulationError(GensigError):
    """A simulation that cannot be run or did not stay finite."""


class StepError(SimulationError):
    """A simulation whose steps were too long; with shorter ones it may be run."""


class Interrupted(KeyboardInterrupt):
    """An interruption; its text says what is kept and how to go on."""


class DatasetError(GensigError):
    """A folder or file that is no data set, is damaged, or would be overwritten."""


class WriteError(DatasetError):
    """A file or folder that the disk refuses to take."""
