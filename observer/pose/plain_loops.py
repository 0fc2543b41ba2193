"""Plain loops over numbers that lie one after the other, compiled into whoever calls them; they vectorise.

All work in place. Shapes: W numbers that belong to W things side by side; K such groups.
"""

from __future__ import annotations

from haptic_env.compiled import part

WIDE = 16  # W


@part()
def take_each(source, at, target):
    """Take the numbers of one of those that lie side by side: (K·W,) to (K,)."""
    for i in range(len(target)):
        target[i] = source[i * WIDE + at]


@part()
def any_above_zero(values):
    """Whether any of some numbers is above zero."""
    found = False
    for i in range(len(values)):
        found |= values[i] > 0.0
    return found


@part()
def fill(value, target):
    """Fill `target` with a number."""
    for i in range(len(target)):
        target[i] = value


@part()
def repeat(values, target):
    """Fill `target` (K·W,) with `values` (W,), again and again."""
    for i in range(0, len(target), WIDE):
        for w in range(WIDE):
            target[i + w] = values[w]


@part()
def copy(source, target):
    """Copy all of `source`."""
    for i in range(len(source)):
        target[i] = source[i]


@part()
def fill_share(chance, before, after, target):
    """Do target = before · chance / after."""
    for i in range(len(target)):
        target[i] = before[i] * chance / after[i]


@part()
def set_apart(share, part, whole, apart, scaled):
    """Do apart = part - whole, scaled = share · apart."""
    for i in range(len(apart)):
        apart[i] = part[i] - whole[i]
        scaled[i] = share[i] * apart[i]


@part()
def negative_share(values, total, target):
    """Do target = -values / total."""
    for i in range(len(target)):
        target[i] = -values[i] / total[i]


@part()
def add_product(first, second, target):
    """Do target += first · second, as far as the second reaches."""
    for i in range(len(second)):
        target[i] += first[i] * second[i]


@part()
def add_products(one, first, other, second, target):
    """Do target += one · first + other · second, as far as the last reaches."""
    for i in range(len(second)):
        target[i] = target[i] + one[i] * first[i] + other[i] * second[i]


@part()
def sum_of_three(a, first, b, second, c, third, target):
    """Do target = a · first + b · second + c · third."""
    for i in range(len(target)):
        target[i] = a * first[i] + b * second[i] + c * third[i]
