# SPDX-License-Identifier: Apache-2.0
"""What a study of any kind says of itself, so that one runner, `running.run_study`, runs them all.

A study is evaluated sample by sample; from all findings follow its tables, from these its summary
and its report.
"""

from __future__ import annotations

import hashlib
import json
from abc import ABC, abstractmethod
from collections.abc import Callable, Generator, Mapping, Sequence
from functools import cached_property
from typing import Any, Generic, Protocol, Self, TypeVar

import pyarrow as pa

from towtank_study.software import software, software_text

RESULTS = "results.parquet"
HISTORIES = "histories.parquet"


class Finding(Protocol):
    """What came of one sample, as it goes into the journal and comes back from it."""

    @property
    def sample(self) -> int: ...

    def entry(self) -> dict[str, Any]:
        """Return it for JSON, which knows no NaN."""

    @classmethod
    def of_entry(cls, entry: Mapping[str, Any]) -> Self: ...


Argument = TypeVar("Argument")
Found = TypeVar("Found", bound=Finding)
Further = TypeVar("Further")


class EvaluateAll(Protocol):
    """Evaluates a picklable function(number, argument) over samples on all workers, unordered."""

    def __call__(
        self, function: Callable[[int, Any], Further], samples: Sequence[tuple[int, Any]], /
    ) -> list[Further]: ...


class Planned(ABC, Generic[Argument, Found]):
    """A study that can be run. The same sample must always give the same finding."""

    @property
    @abstractmethod
    def name(self) -> str: ...

    @property
    @abstractmethod
    def texts(self) -> dict[str, str]:
        """Texts that the results depend on, by name."""

    @property
    @abstractmethod
    def most_samples(self) -> int: ...

    @property
    @abstractmethod
    def finding(self) -> type[Found]: ...

    @property
    @abstractmethod
    def table_names(self) -> list[str]:
        """Names of the files of `tables`; RESULTS, the last, says that the study is done."""

    @abstractmethod
    def evaluation(self) -> Callable[[int, Argument], Found]:
        """Return what evaluates a sample by number and argument; it can be pickled."""

    @abstractmethod
    def batches(self) -> Generator[list[Argument], list[Found], None]:
        """Yield the arguments of samples, batch by batch, and be sent the findings of each."""

    @abstractmethod
    def tables(
        self, arguments: list[Argument], findings: list[Found], evaluate: EvaluateAll
    ) -> dict[str, pa.Table]:
        """Return tables by names of files; of each sample its argument and finding."""

    @abstractmethod
    def summary(self, tables: Mapping[str, pa.Table]) -> dict[str, Any]:
        """Return what was found, for JSON."""

    @abstractmethod
    def report(self, tables: Mapping[str, pa.Table], summary: dict[str, Any]) -> str:
        """Return the report as HTML."""

    @cached_property
    def software(self) -> str:
        """What computes, as it was when this was first asked for."""
        return software_text(software())

    @cached_property
    def fingerprint(self) -> str:
        """SHA-256 over all that the results depend on: the texts and the software."""
        parts = [*self.texts.values(), self.software]
        return hashlib.sha256(json.dumps(parts).encode()).hexdigest()

    @property
    def metadata(self) -> dict[str, str]:
        """What a table says about itself."""
        return self.texts | {"software": self.software, "fingerprint": self.fingerprint}
