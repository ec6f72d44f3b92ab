"""Windows: maximal chains of steps in which pairs meet or push, cut where they grow long.

A node is a pair that is active in a step. Nodes are joined if they share a movable disc in one step, or are one pair in
successive steps; and chains that hold one disc at one time are one chain. So each disc is in one window at a time.
"""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, replace

from carom.comparator.local_truth.bodies import Law, Pair

__all__ = ["LONGEST", "Chain", "chains_of"]

#: Steps after which a chain is cut at a boundary: what comes after is judged from the run's own state there. A contact
#: of more steps is answered later than any sampling is; in crowds soft contacts chain up without end.
LONGEST = 8

_Node = tuple[int, Pair]


@dataclass(frozen=True)
class Chain:
    """Steps `begin` to `end` (exclusive), its discs, and in which steps each of its pairs is active.

    One that `continues` began before, and was cut where it begins.
    """

    begin: int
    end: int
    discs: tuple[int, ...]
    pairs: Mapping[Pair, tuple[int, ...]]
    continues: bool = False

    @classmethod
    def of(cls, law: Law, nodes: Iterable[_Node]) -> Chain:
        """Return the chain of some nodes."""
        steps: dict[Pair, list[int]] = defaultdict(list)
        for step, pair in sorted(nodes):
            steps[pair].append(step)
        every = [step for some in steps.values() for step in some]
        discs = sorted({body for pair in steps for body in pair if body < law.n})
        return cls(min(every), max(every) + 1, tuple(discs), {pair: tuple(some) for pair, some in steps.items()})


class _Groups:
    """Disjoint sets of anything that can be a key."""

    def __init__(self) -> None:
        self._parent: dict[object, object] = {}

    def find(self, item: object) -> object:
        while self._parent.setdefault(item, item) != item:
            self._parent[item] = self._parent[self._parent[item]]
            item = self._parent[item]
        return item

    def join(self, one: object, other: object) -> None:
        self._parent[self.find(one)] = self.find(other)


def chains_of(law: Law, due: Mapping[int, Iterable[Pair]]) -> list[Chain]:
    """Return the windows of the pairs that are active in each step, in order of their beginnings."""
    nodes = [(step, pair) for step in sorted(due) for pair in due[step]]
    found = list[Chain]()
    for chain in _chained(law, nodes):
        if chain.end - chain.begin <= LONGEST:
            found.append(chain)
            continue
        pieces: dict[int, list[_Node]] = defaultdict(list)
        for pair, steps in chain.pairs.items():
            for step in steps:
                pieces[(step - chain.begin) // LONGEST].append((step, pair))
        for number, some in pieces.items():
            cut = chain.begin + number * LONGEST
            found += [replace(one, continues=number > 0 and one.begin == cut) for one in _chained(law, some)]
    return sorted(found, key=lambda chain: (chain.begin, chain.discs))


def _chained(law: Law, nodes: list[_Node]) -> list[Chain]:
    groups, known = _Groups(), set(nodes)
    owner: dict[tuple[int, int], _Node] = {}
    for step, pair in nodes:
        groups.find((step, pair))
        if (step - 1, pair) in known:
            groups.join((step, pair), (step - 1, pair))
        for body in pair:
            if law.movable(body):
                groups.join((step, pair), owner.setdefault((step, body), (step, pair)))
    gathered: dict[object, list[_Node]] = defaultdict(list)
    for node in nodes:
        gathered[groups.find(node)].append(node)
    chains = [Chain.of(law, some) for some in gathered.values()]
    while True:
        groups, holder = _Groups(), dict[tuple[int, int], int]()
        for number, chain in enumerate(chains):
            groups.find(number)
            for disc in filter(law.movable, chain.discs):
                for step in range(chain.begin, chain.end):
                    groups.join(number, holder.setdefault((step, disc), number))
        merged: dict[object, list[Chain]] = defaultdict(list)
        for number, chain in enumerate(chains):
            merged[groups.find(number)].append(chain)
        if len(merged) == len(chains):
            return chains
        chains = [
            one[0]
            if len(one) == 1
            else Chain.of(law, [(step, pair) for chain in one for pair, steps in chain.pairs.items() for step in steps])
            for one in merged.values()
        ]
