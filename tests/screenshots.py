"""Screenshots of the pages that gensig writes, for README.md: ``python -m tests.screenshots``.

It needs Chromium, and makes the data set and the training of README's ten lines of shell first.
"""

import shutil
import subprocess
import sys
import tempfile
from pathlib import Path

FOLDER = Path(__file__).resolve().parents[1] / "docs" / "figures"
BROWSERS = ("chromium", "chromium-browser", "google-chrome")
QUIET = (
    "--headless",
    "--no-sandbox",
    "--disable-gpu",
    "--disable-background-networking",
    "--disable-component-update",
    "--disable-sync",
    "--no-first-run",
    "--hide-scrollbars",
    "--virtual-time-budget=10000",
)
DATA = ("experiment=quickstart", "plan.n_records=80", "out=quick")
# picture -> page, width and height in pixels
SHOTS = {"report.png": ("quick/report.html", 1280, 1500)}


def run(program: str, *words: str, folder: Path) -> None:
    """Run one of our commands."""
    path = Path(sys.executable).with_name(program)
    subprocess.run([path, *words], cwd=folder, check=True)


def shoot(browser: str, page: Path, picture: Path, width: int, height: int) -> None:
    """Write what the browser shows of a page."""
    with tempfile.TemporaryDirectory() as profile:
        command = [
            browser,
            *QUIET,
            f"--user-data-dir={profile}",
            f"--window-size={width},{height}",
            f"--screenshot={picture}",
            page.as_uri(),
        ]
        subprocess.run(command, check=True, capture_output=True)


def main() -> int:
    """Make the pages and shoot them."""
    browser = next(filter(None, map(shutil.which, BROWSERS)), None)
    if browser is None:
        print(f"no browser; install one of {', '.join(BROWSERS)}")
        return 2
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        run("gensig", "generate", *DATA, folder=folder)
        run("gensig", "report", "quick", folder=folder)
        for picture, (page, width, height) in SHOTS.items():
            shoot(browser, folder / page, FOLDER / picture, width, height)
            print(FOLDER / picture)
    return 0


if __name__ == "__main__":
    sys.exit(main())
