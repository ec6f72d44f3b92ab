"""Compiled search for near pairs of discs. The discs form a tree, which is searched once for each disc.

`carom.model.broad_phase` explains the search.
"""

import numpy as np

from cython cimport final
from libc.stdlib cimport free, malloc

cdef enum:
    CAPACITY = 1 << 16  # a result has memory for as many pairs as there are discs, plus this number
    LEAF = 8  # largest number of discs in a leaf; with fewer the tree is larger, with more the search is slower

cdef struct Item:  # data of a disc that the search compares; 32 bytes
    double x
    double y
    double reach
    Py_ssize_t number

cdef struct Node:  # bounds of all discs below a node of the tree; 48 bytes
    double low_x  # smallest x of the centres
    double high_x
    double low_y
    double high_y
    double reach  # largest reach of the node's discs
    Py_ssize_t lowest  # smallest number of the node's discs

cdef struct Tree:  # the discs of node k are halved; nodes 2 k + 1 and 2 k + 2 contain one half each
    Item* items
    Node* nodes
    Py_ssize_t count

cdef struct Pairs:  # the pairs found, in arrays of length `capacity`
    Py_ssize_t* first
    Py_ssize_t* second
    Py_ssize_t count
    Py_ssize_t capacity


cdef inline bint is_near(double dx, double dy, double reach) noexcept nogil:
    return reach >= 0.0 and dx * dx + dy * dy <= reach * reach


cdef inline double distance_to(double low, double high, double x) noexcept nogil:
    """Return the distance from `x` to the interval between `low` and `high`."""
    if x < low:
        return low - x
    return x - high if x > high else 0.0


cdef inline double coordinate(const Item* item, bint is_x) noexcept nogil:
    return item.x if is_x else item.y


cdef void split(Item* items, Py_ssize_t begin, Py_ssize_t end, Py_ssize_t middle, bint by_x) noexcept nogil:
    """Move the items with the smallest coordinates before index `middle`, and all others to `middle` and after it."""
    cdef unsigned long long random = 1  # pivots are random, so that no order of items is always slow
    cdef Py_ssize_t low = begin, high = end - 1, i, j
    cdef double pivot
    cdef Item item
    while low < high:
        random = random * 6364136223846793005ULL + 1442695040888963407ULL
        pivot = coordinate(&items[low + <Py_ssize_t> ((random >> 33) % <unsigned long long> (high - low + 1))], by_x)
        i, j = low, high
        while i <= j:
            while coordinate(&items[i], by_x) < pivot:
                i += 1
            while pivot < coordinate(&items[j], by_x):
                j -= 1
            if i <= j:
                item = items[i]
                items[i] = items[j]
                items[j] = item
                i += 1
                j -= 1
        if middle <= j:
            high = j
        elif middle >= i:
            low = i
        else:
            return


cdef void build(Tree* tree, Py_ssize_t k, Py_ssize_t begin, Py_ssize_t end) noexcept nogil:
    """Build node `k` and all nodes below it. Items are halved along the longer side of the box around their centres."""
    cdef Node* node = &tree.nodes[k]
    cdef const Item* item
    cdef Py_ssize_t i, middle
    item = &tree.items[begin]
    node.low_x = node.high_x = item.x
    node.low_y = node.high_y = item.y
    node.reach = item.reach
    node.lowest = item.number
    for i in range(begin + 1, end):
        item = &tree.items[i]
        node.low_x = min(node.low_x, item.x)
        node.high_x = max(node.high_x, item.x)
        node.low_y = min(node.low_y, item.y)
        node.high_y = max(node.high_y, item.y)
        node.reach = max(node.reach, item.reach)
        node.lowest = min(node.lowest, item.number)
    if end - begin <= LEAF:
        return
    middle = begin + (end - begin) // 2
    split(tree.items, begin, end, middle, node.high_x - node.low_x >= node.high_y - node.low_y)
    build(tree, 2 * k + 1, begin, middle)
    build(tree, 2 * k + 2, middle, end)


cdef bint find(const Tree* tree, Py_ssize_t k, Py_ssize_t begin, Py_ssize_t end, Item disc, Pairs* pairs) noexcept nogil:
    """Add the pairs of `disc` with lower-numbered discs of node `k`. Return False if the array of pairs is full."""
    cdef const Node* node = &tree.nodes[k]
    cdef Py_ssize_t i, middle
    if node.lowest >= disc.number or not is_near(
        distance_to(node.low_x, node.high_x, disc.x),
        distance_to(node.low_y, node.high_y, disc.y),
        node.reach + disc.reach,
    ):
        return True
    if end - begin > LEAF:
        middle = begin + (end - begin) // 2
        return find(tree, 2 * k + 1, begin, middle, disc, pairs) and find(tree, 2 * k + 2, middle, end, disc, pairs)
    for i in range(begin, end):
        item = &tree.items[i]
        if item.number < disc.number and is_near(disc.x - item.x, disc.y - item.y, item.reach + disc.reach):
            if pairs.count == pairs.capacity:
                return False
            pairs.first[pairs.count] = item.number
            pairs.second[pairs.count] = disc.number
            pairs.count += 1
    return True


cdef Py_ssize_t node_count(Py_ssize_t items):
    """Return the number of nodes of a complete tree for the given number of items."""
    cdef Py_ssize_t leaves = 1
    while items > LEAF * leaves:
        leaves *= 2
    return 2 * leaves - 1


@final
cdef class Search:
    """Search for near pairs of discs. `carom.model.broad_phase.find_near_pairs` describes the arguments."""

    cdef const double[:, ::1] position
    cdef const double[::1] reach
    cdef const unsigned char[::1] movable
    cdef Tree[2] trees  # one tree for immovable discs, one tree for movable discs

    def __cinit__(self, const double[:, ::1] position, const double[::1] reach, const unsigned char[::1] movable):
        cdef Py_ssize_t i, kind, n = position.shape[0]
        cdef Tree* tree
        if position.shape[1] != 2 or reach.shape[0] != n or movable.shape[0] != n:
            raise ValueError("position must have shape (n, 2), reach and movable (n,)")
        self.position, self.reach, self.movable = position, reach, movable
        for i in range(n):
            self.trees[movable[i] != 0].count += 1
        for kind in range(2):
            tree = &self.trees[kind]
            if tree.count > 0:
                tree.items = <Item*> malloc(tree.count * sizeof(Item))
                tree.nodes = <Node*> malloc(node_count(tree.count) * sizeof(Node))
                if tree.items == NULL or tree.nodes == NULL:
                    raise MemoryError
                tree.count = 0
        with nogil:
            for i in range(n):
                tree = &self.trees[movable[i] != 0]
                tree.items[tree.count] = Item(position[i, 0], position[i, 1], reach[i], i)
                tree.count += 1
            for kind in range(2):
                if self.trees[kind].count > 0:
                    build(&self.trees[kind], 0, 0, self.trees[kind].count)

    def __dealloc__(self):
        for kind in range(2):
            free(self.trees[kind].items)
            free(self.trees[kind].nodes)

    def pairs(self, Py_ssize_t begin):
        """Return the pairs whose higher disc number is at least `begin`, disc by disc until the array is full.

        Returns:
            Two arrays with the lower and the higher number of each pair, in no particular order, and the value of
            `begin` for the next call.
        """
        cdef Py_ssize_t i, done, n = self.position.shape[0]
        # The array with this capacity is usually large enough. There are far more near pairs than discs only if many
        # discs overlap.
        cdef Py_ssize_t capacity = max(1, min(n * (n - 1) // 2, n + CAPACITY))
        cdef Py_ssize_t[::1] first = np.empty(capacity, np.intp), second = np.empty(capacity, np.intp)
        cdef Pairs pairs = Pairs(&first[0], &second[0], 0, capacity)
        cdef Item disc
        with nogil:
            if begin == 0 and self.find_all(&pairs):
                i = n
            else:
                pairs.count = 0
                for i in range(begin, n):
                    done = pairs.count
                    disc = Item(self.position[i, 0], self.position[i, 1], self.reach[i], i)
                    if not self.find_of(disc, self.movable[i] != 0, &pairs):
                        pairs.count = done
                        break
                else:
                    i = n
        return first.base[: pairs.count], second.base[: pairs.count], i

    cdef bint find_all(self, Pairs* pairs) noexcept nogil:
        """Add all pairs in the order of the trees, which uses the cache well. Return False if the array is full."""
        cdef Py_ssize_t kind, k
        for kind in range(2):
            for k in range(self.trees[kind].count):
                if not self.find_of(self.trees[kind].items[k], kind == 1, pairs):
                    return False
        return True

    cdef bint find_of(self, Item disc, bint movable, Pairs* pairs) noexcept nogil:
        """Add the pairs of one disc with lower-numbered discs. Return False if the array of pairs is full.

        Pairs of two immovable discs are not added.
        """
        cdef const Tree* tree
        cdef Py_ssize_t kind
        for kind in range(0 if movable else 1, 2):
            tree = &self.trees[kind]
            if tree.count > 0 and not find(tree, 0, 0, tree.count, disc, pairs):
                return False
        return True
