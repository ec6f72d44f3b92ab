"""What the campaign has found so far: counts a kind of gas, kept in a file, shown as a table."""

from __future__ import annotations

import json
from dataclasses import asdict, dataclass, field
from pathlib import Path

from tests.campaign.gases import Gas, Kind
from tests.checker import Report

from carom.support.folders import write_file

#: Findings that are kept: a broken kernel makes them by the thousand.
_KEPT = 100


@dataclass(frozen=True)
class Finding:
    """One violation, or a crash, and how to see it again."""

    number: int
    text: str

    def __str__(self) -> str:
        return f"{self.text}\n    again: python -m tests.campaign --gas {self.number}"


@dataclass
class Count:
    """Counts over all gases of a kind."""

    gases: int = 0
    fewest_discs: int = 0
    most_discs: int = 0
    least_packing: float = 0.0
    most_packing: float = 0.0
    impacts: int = 0
    pairs: int = 0
    phantoms: int = 0
    passed: int = 0
    others: int = 0
    worst_gap: float = 0.0
    worst_overlap: float = 0.0


@dataclass
class Tally:
    """All that the campaign has done."""

    begun: int = 0
    counts: dict[Kind, Count] = field(default_factory=lambda: {kind: Count() for kind in Kind})
    findings: list[Finding] = field(default_factory=list)

    @property
    def impacts(self) -> int:
        """Impacts checked."""
        return sum(count.impacts for count in self.counts.values())

    @property
    def broken(self) -> int:
        """Rules broken, crashes included."""
        counted = sum(count.phantoms + count.passed + count.others for count in self.counts.values())
        return max(counted, len(self.findings))

    def add(self, gas: Gas, report: Report) -> list[Finding]:
        """Count one gas; return what was found."""
        count, discs = self.counts[gas.kind], len(gas.start)
        count.fewest_discs = min(count.fewest_discs or discs, discs)
        count.most_discs = max(count.most_discs, discs)
        count.least_packing = min(count.least_packing or gas.packing, gas.packing)
        count.most_packing = max(count.most_packing, gas.packing)
        count.gases += 1
        count.impacts += report.impacts
        count.pairs += report.pairs
        for violation in report.violations:
            if violation.rule == "contact":
                count.phantoms += 1
            elif violation.rule == "passed":
                count.passed += 1
            else:
                count.others += 1
        count.worst_gap = max(count.worst_gap, report.worst_gap)
        count.worst_overlap = max(count.worst_overlap, report.worst_overlap)
        return self.find([Finding(gas.number, str(violation)) for violation in report.violations])

    def find(self, findings: list[Finding]) -> list[Finding]:
        """Keep findings, and return them."""
        self.findings += findings[: max(0, _KEPT - len(self.findings))]
        return findings

    def table(self) -> str:
        """Return the counts as a Markdown table."""
        head = (
            "| gases | how many | discs | packing | impacts | pairs of flights | phantoms | passed unseen "
            "| other rules | largest gap | deepest overlap |"
        )
        lines = [head, "| --- |" + " ---: |" * 10]
        for kind, count in self.counts.items():
            packing = f"{count.least_packing:.2f} to {count.most_packing:.2f}" if count.most_packing else ""
            lines.append(
                f"| {kind} | {count.gases:,} | {count.fewest_discs:,} to {count.most_discs:,} | {packing} "
                f"| {count.impacts:,} | {count.pairs:,} | {count.phantoms:,} | {count.passed:,} | {count.others:,} "
                f"| {count.worst_gap:.3f} | {count.worst_overlap:.3f} |"
            )
        counts = self.counts.values()
        lines.append(
            f"| all | {sum(c.gases for c in counts):,} | | | {self.impacts:,} | {sum(c.pairs for c in counts):,} "
            f"| {sum(c.phantoms for c in counts):,} | {sum(c.passed for c in counts):,} "
            f"| {sum(c.others for c in counts):,} | {max(c.worst_gap for c in counts):.3f} "
            f"| {max(c.worst_overlap for c in counts):.3f} |"
        )
        return "\n".join(lines)

    @classmethod
    def load(cls, path: Path) -> Tally:
        """Return what a file holds, nothing done where there is none."""
        if not path.exists():
            return cls()
        held = json.loads(path.read_text(encoding="utf-8"))
        counts = {kind: Count(**held["counts"].get(kind.name, {})) for kind in Kind}
        return cls(held["begun"], counts, [Finding(**finding) for finding in held["findings"]])

    def save(self, path: Path) -> None:
        """Write all to a file, whole or not at all."""
        held = {
            "begun": self.begun,
            "counts": {kind.name: asdict(count) for kind, count in self.counts.items()},
            "findings": [asdict(finding) for finding in self.findings],
        }
        write_file(path, json.dumps(held, indent=1) + "\n")
