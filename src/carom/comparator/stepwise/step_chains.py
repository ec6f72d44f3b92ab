"""Construction of windows: chains of successive steps in which pairs of bodies meet or push.

Two pairs that are active in the same step are in the same chain if they share a movable disc. A pair that is active in
successive steps stays in its chain. So each disc is in at most one chain at a time. A chain that would be longer than
`LONGEST` steps is cut, and pairs that are still active begin a new chain. So each chain is complete after at most
`LONGEST` steps.
"""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, field, replace

from carom.comparator.stepwise.scene_bodies import Pair, SceneBodies

#: Largest number of steps of a chain. Further steps begin a new chain. Checking once per step can't explain a contact
#: that lasts longer. Without this limit, soft contacts in dense groups of discs would form endless chains.
LONGEST = 8


@dataclass(frozen=True, eq=False)
class StepChain:
    """A chain of the steps `begin` to `end` (exclusive), with its discs, and the steps in which each pair is active.

    If `is_cut_at_begin` is set, a longer chain was cut at `begin`, and this chain is its second part. If
    `is_cut_at_end` is set, a longer chain was cut at `end`, and this chain is its first part.
    """

    begin: int
    end: int
    discs: tuple[int, ...]
    pairs: Mapping[Pair, tuple[int, ...]]
    is_cut_at_begin: bool = False
    is_cut_at_end: bool = False

    def shift_steps(self, steps: int) -> StepChain:
        """Return the chain with its step numbers increased by `steps`."""
        pairs = {pair: tuple(step + steps for step in active) for pair, active in self.pairs.items()}
        return replace(self, begin=self.begin + steps, end=self.end + steps, pairs=pairs)


class Chains:
    """Builds chains from the active pairs of each step, and returns chains that are complete.

    Args:
        bodies: The scene's bodies.

    Attributes:
        open_chains: Chains to which later steps may be added.
    """

    def __init__(self, bodies: SceneBodies) -> None:
        self._bodies = bodies
        self.open_chains: list[StepChain] = []
        self._complete: list[StepChain] = []
        self._next = 0

    @property
    def complete_until(self) -> int:
        """Number of steps up to which all chains are complete. Chains that end later may still grow."""
        return max(self._next + 1 - LONGEST, 0)

    def skip_to(self, step: int) -> None:
        """Continue at a later step. No pair is active in the skipped steps."""
        self._next = step

    def add(self, step: int, active: Iterable[Pair]) -> None:
        """Add the active pairs of the next step."""
        self.skip_to(step + 1)
        pairs = list(active)
        self._complete += [chain for chain in self.open_chains if chain.end < self.complete_until]
        self.open_chains = [chain for chain in self.open_chains if chain.end >= self.complete_until]
        last = {
            pair: chain
            for chain in self.open_chains
            if chain.end == step
            for pair, active_steps in chain.pairs.items()
            if active_steps[-1] == step - 1
        }
        cut = set[StepChain]()
        while True:
            groups = self._build_groups(step, pairs, {pair: chain for pair, chain in last.items() if chain not in cut})
            too_long = {
                chain for group in groups if group.is_too_long(cut) for chain in group.chains if chain.end == step
            }
            if too_long <= cut:
                break
            cut |= too_long
        grouped = {chain for group in groups for chain in group.chains}
        held_chains = [chain for chain in self.open_chains if chain not in grouped]
        self.open_chains = [replace(chain, is_cut_at_end=True) if chain in cut else chain for chain in held_chains]
        self.open_chains += [
            group.build_chain(self._bodies, is_cut_at_begin=any(last.get(pair) in cut for pair in group.pairs))
            for group in groups
        ]

    def take_complete(self, *, ends: bool = False) -> list[StepChain]:
        """Remove and return the complete chains, sorted by their ends. If `ends` is true, return all chains."""
        done = self._complete + [chain for chain in self.open_chains if ends or chain.end <= self.complete_until]
        self.open_chains, self._complete = [chain for chain in self.open_chains if chain not in done], []
        return sorted(done, key=lambda chain: (chain.end, chain.begin, chain.discs))

    def _build_groups(self, step: int, pairs: list[Pair], last: Mapping[Pair, StepChain]) -> list[_Group]:
        """Return groups of active pairs and existing chains. Each group becomes one chain in this step.

        A disc may be in only one chain at a time, so groups with a common movable disc are joined.
        """
        movable = self._bodies.is_movable
        holders: dict[int, list[StepChain]] = defaultdict(list)
        for chain in self.open_chains:
            for disc in filter(movable, chain.discs):
                holders[disc].append(chain)
        groups: dict[int, _Group] = {}  # the group of each disc
        for pair in pairs:
            group = _Group(step, step, [pair], set(filter(movable, pair)))
            if pair in last:
                group.add_chain(last[pair], movable)
            while True:
                others = {groups[disc] for disc in group.discs if groups.get(disc, group) is not group}
                held = {chain for disc in group.discs for chain in holders[disc] if chain.end > group.begin}
                held -= group.chains
                for other in others:
                    group.join(other)
                for chain in held:
                    group.add_chain(chain, movable)
                groups |= dict.fromkeys(group.discs, group)
                if not (others or held):
                    break
        return list(dict.fromkeys(groups.values()))


@dataclass(eq=False)
class _Group:
    """Active pairs of a step, and the existing chains that they join into one.

    Attributes:
        step: The step.
        begin: First step of the joined chain.
        pairs: The active pairs.
        discs: Movable discs of the joined chain.
        chains: The existing chains.
    """

    step: int
    begin: int
    pairs: list[Pair]
    discs: set[int]
    chains: set[StepChain] = field(default_factory=set)

    def add_chain(self, chain: StepChain, movable: Callable[[int], bool]) -> None:
        """Add an existing chain."""
        self.chains.add(chain)
        self.begin = min(self.begin, chain.begin)
        self.discs.update(filter(movable, chain.discs))

    def join(self, other: _Group) -> None:
        """Add all pairs and chains of another group."""
        self.begin = min(self.begin, other.begin)
        self.pairs += other.pairs
        self.discs |= other.discs
        self.chains |= other.chains

    def is_too_long(self, cut: set[StepChain]) -> bool:
        """Whether the joined chain has too many steps, or includes a chain that was cut."""
        return self.step + 1 - self.begin > LONGEST or any(chain.is_cut_at_end or chain in cut for chain in self.chains)

    def build_chain(self, bodies: SceneBodies, *, is_cut_at_begin: bool) -> StepChain:
        """Return the joined chain.

        The joined chain continues a cut chain if `is_cut_at_begin` is set, or if its first chain continues a cut chain.
        """
        pairs: dict[Pair, tuple[int, ...]] = defaultdict(tuple)
        for chain in self.chains:
            for pair, steps in chain.pairs.items():
                pairs[pair] += steps
            is_cut_at_begin |= chain.is_cut_at_begin and chain.begin == self.begin
        for pair in self.pairs:
            pairs[pair] += (self.step,)
        discs = {disc for chain in self.chains for disc in chain.discs}
        discs |= {body for pair in self.pairs for body in pair if body < bodies.n}
        in_order = {pair: tuple(sorted(pairs[pair])) for pair in sorted(pairs)}
        return StepChain(self.begin, self.step + 1, tuple(sorted(discs)), in_order, is_cut_at_begin)
