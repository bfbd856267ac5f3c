"""Environment of a run, kept in the manifest for people; it decides no bit."""

import platform
import re
import subprocess
from datetime import UTC, datetime
from importlib import metadata
from pathlib import Path
from typing import Any

from gensig.version import __version__

PACKAGES = ("numpy", "scipy", "numba", "h5py", "hdf5plugin")


def environment() -> dict[str, Any]:
    """Versions of Python and packages, processor, platform, git commit or '', and time (UTC)."""
    return {
        "python": platform.python_version(),
        **{name: _version(name) for name in PACKAGES},
        "gensig": __version__,  # a checkout that is used as it is has outgrown what was installed
        "cpu_model": _cpu_model(),
        "platform": platform.platform(),
        "git_commit": _git_commit(),
        "created": now(),
    }


def now() -> str:
    """The time as ISO 8601 in UTC, to the second."""
    return datetime.now(UTC).isoformat(timespec="seconds")


def _version(package: str) -> str:
    try:
        return metadata.version(package)
    except metadata.PackageNotFoundError:
        return ""


def _cpu_model() -> str:
    try:
        text = Path("/proc/cpuinfo").read_text(encoding="utf-8", errors="replace")
    except OSError:
        return platform.processor()
    match = re.search(r"^model name.*?:(.*)", text, re.MULTILINE)
    return match[1].strip() if match else platform.machine()


def _git_commit() -> str:
    """The commit of gensig's own checkout.

    An installed copy inside somebody else's repository has none.
    """
    root = Path(__file__).resolve().parents[3]
    if not (root / ".git").exists():
        return ""
    try:
        run = subprocess.run(
            ["git", "-C", str(root), "rev-parse", "HEAD"],
            capture_output=True,
            text=True,
            timeout=5,
            check=False,
        )
    except (OSError, subprocess.SubprocessError):
        return ""
    return "" if run.returncode else run.stdout.strip()
