"""Interface of reports: a page, tables and lines on the study of a learning target."""

from __future__ import annotations

from abc import ABC, abstractmethod
from pathlib import Path
from typing import ClassVar

from diagnose.studies.result_files import Content, write_metrics
from gensig.text.page import Section, write_page


class Report(ABC):
    """Report on a study.

    Attributes
    ----------
    title : of the page
    metrics : content of ``metrics.json``
    """

    title: ClassVar[str]
    metrics: Content

    @abstractmethod
    def lines(self) -> list[str]:
        """First figures and tables as Markdown."""

    @abstractmethod
    def lead(self) -> list[str]:
        """First paragraphs of the page."""

    @abstractmethod
    def sections(self, folder: Path) -> list[Section]:
        """Sections of the page; their figures are written into a folder."""

    @abstractmethod
    def write_tables(self, folder: Path) -> None:
        """Write tables and texts beside the page."""

    def write(self, folder: Path) -> Path:
        """Write ``metrics.json``, tables, figures and ``report.html``; return the page."""
        write_metrics(folder, self.metrics)
        self.write_tables(folder)
        page = folder / "report.html"
        write_page(
            page,
            title=self.title,
            lead=self.lead(),
            sections=self.sections(folder),
            program="diagnose train",
        )
        return page
