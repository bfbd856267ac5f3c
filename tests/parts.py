"""The parts of a run of the tests, and the time that each took."""

import time
from collections import Counter
from pathlib import PurePosixPath


class Parts:
    """Seconds until the first test, and those of the tests of each folder in all processes."""

    def __init__(self):
        self.began = time.monotonic()
        self.seconds = Counter()

    def pytest_runtest_logstart(self):
        self.seconds.setdefault("collection", time.monotonic() - self.began)

    def pytest_runtest_logreport(self, report):
        path = PurePosixPath(report.nodeid.partition("::")[0])
        folder = PurePosixPath(*path.parent.parts[:3])
        self.seconds[str(folder)] += report.duration

    def pytest_terminal_summary(self, terminalreporter):
        terminalreporter.section("seconds of each part, the processes together")
        for part, seconds in self.seconds.most_common():
            terminalreporter.line(f"{seconds:7.1f} {part}")
