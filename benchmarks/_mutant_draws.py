"""Mutants: the fixed ones, and those drawn by a seed from all public modules of the project."""

from __future__ import annotations

import random
from collections import defaultdict
from collections.abc import Iterator
from dataclasses import dataclass
from functools import cache
from pathlib import Path

from benchmarks._fixed_mutants import FIXED
from benchmarks._mutation import OF_OTHERS, Site, mutated_source, sites

FOLDERS = ("gensig", "diagnose")
BY_HAND = "by hand"  # operator of the fixed mutants
MOST_DRAWS = 10000


@dataclass(frozen=True, slots=True, kw_only=True)
class Mutant:
    """The code with one bug.

    Attributes
    ----------
    file : path of the module, relative to the project
    line : number of the changed line, from 1
    function : qualified name of the function around it; of a fixed mutant the name of the bug
    operator : of `benchmarks._mutation.OPERATORS`, or ``by hand``
    text : the line in full, without the spaces around it
    original, mutated : what changes in it, before and after
    """

    file: str
    line: int
    function: str
    operator: str
    text: str
    original: str
    mutated: str

    @property
    def key(self) -> tuple[str, ...]:
        """Identity that a shift of lines leaves alone."""
        return self.file, self.function, self.text, self.original, self.mutated

    @property
    def package(self) -> str:
        """The package of the module, as in `packages`."""
        return _package(self.file)

    def fits(self, root: Path) -> bool:
        """True if the module has the place of the bug, once."""
        path = root / self.file
        if not path.exists():
            return False
        text = path.read_text(encoding="utf-8")
        if self.operator == BY_HAND:
            return text.count(self.original) == 1
        return self.key[1:] in _sites_by_key(text)

    def source(self, root: Path) -> str:
        """Text of the module with the bug."""
        text = (root / self.file).read_text(encoding="utf-8")
        if self.operator == BY_HAND:
            return text.replace(self.original, self.mutated)
        return mutated_source(text, _sites_by_key(text)[self.key[1:]])


def _sites_by_key(text: str) -> dict[tuple[str, ...], Site]:
    """Sites of a source text by all of a mutant's key but the file."""
    return {
        (site.function, site.text, site.original, site.mutated): site
        for site in sites(text)
    }


def fixed_mutants(root: Path) -> list[Mutant]:
    """The mutants of `benchmarks._fixed_mutants`; raises unless each fits one place."""
    mutants = []
    for bug in FIXED:
        text = (root / bug.file).read_text(encoding="utf-8")
        line = text.partition(bug.original)[0].count("\n") + 1
        mutant = Mutant(
            file=bug.file,
            line=line,
            function=bug.name,
            operator=BY_HAND,
            text=text.split("\n")[line - 1].strip(),
            original=bug.original,
            mutated=bug.mutated,
        )
        if not mutant.fits(root):
            raise ValueError(f"{bug.file} must have '{bug.original}' once: {bug.name}")
        mutants.append(mutant)
    return mutants


def drawn_mutants(root: Path, seed: int) -> Iterator[Mutant]:
    """Mutants without end, each drawn apart: a change of one module leaves most others.

    Every second one is of the kinds of bugs that others found (`OF_OTHERS`), which take turns; its
    module is any that has such a site. Between them, packages take turns; of each a module is
    drawn, of it an operator, then a site.
    """
    modules = public_modules(root)
    by_package = defaultdict(list)
    for module in modules:
        by_package[_package(module)].append(module)
    names = sorted(by_package)
    seen = set()
    for number in range(MOST_DRAWS):
        rng = random.Random(f"{seed}/{number}")
        turn = number // 2
        if number % 2 == 0:
            candidates = rng.sample(modules, len(modules))
            operator = OF_OTHERS[turn % len(OF_OTHERS)]
        else:
            of_package = by_package[names[turn % len(names)]]
            candidates = rng.sample(of_package, len(of_package))
            operator = ""
        mutant = _mutant_of(root, candidates, operator, rng)
        if mutant is not None and mutant.key not in seen:
            seen.add(mutant.key)
            yield mutant


def _mutant_of(
    root: Path, candidates: list[str], operator: str, rng: random.Random
) -> Mutant | None:
    """A mutant of the first of some modules that has a site of an operator; '' is any operator."""
    for module in candidates:
        by_operator = _sites_by_operator(root / module)
        if operator in by_operator or (by_operator and not operator):
            kind = operator or rng.choice(sorted(by_operator))
            site = rng.choice(by_operator[kind])
            return Mutant(
                file=module,
                line=site.line,
                function=site.function,
                operator=site.operator,
                text=site.text,
                original=site.original,
                mutated=site.mutated,
            )
    return None


@cache
def _sites_by_operator(path: Path) -> dict[str, list[Site]]:
    by_operator = defaultdict(list)
    for site in sites(path.read_text(encoding="utf-8")):
        by_operator[site.operator].append(site)
    return dict(by_operator)


def _package(file: str) -> str:
    """Folder of a module, one below ``gensig`` or ``diagnose``, or one of these."""
    return "/".join(file.split("/")[:-1][:2])


def public_modules(root: Path) -> list[str]:
    """All modules of both packages but private ones, which are compiled with the kernels."""
    return [
        path.relative_to(root).as_posix()
        for folder in FOLDERS
        for path in sorted((root / folder).rglob("*.py"))
        if path.stem == "__init__" or not path.stem.startswith("_")
    ]


def packages(root: Path) -> list[str]:
    """The folders that mutants are drawn from."""
    return sorted({_package(module) for module in public_modules(root)})
