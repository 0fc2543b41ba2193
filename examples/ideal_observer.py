"""How often an ideal observer names an object right after some seconds, beside one that forgets and one that lapses.

The courses of belief that ship are of two ellipsoids and two cuboids; `haptic-slam evaluate --courses` makes your own.
"""

from haptic_lab.people import options
from haptic_lab.people.courses import Courses
from haptic_lab.people.decisions import Decision

OBSERVERS = {
    "ideal": Decision(),
    "forgets in 0.5 s": Decision(memory_seconds=0.5),
    "guesses in 1 of 10": Decision(lapse=0.1),
}


def main(sigma=3.0, times=(0.5, 1.0, 2.0, 5.0)):
    """The share right of each observer after each time, over all objects."""
    courses = Courses.load(options.SHIPPED["courses"])
    found = {}
    for name, decision in OBSERVERS.items():
        found[name] = []
        for seconds in times:
            shares = [
                decision.response_probabilities(courses, courses.cell(each), sigma=sigma, seconds=seconds)[index]
                for index, each in enumerate(courses.names)
            ]
            found[name].append(sum(shares) / len(shares))
        told = ", ".join(f"{share:.0%} after {seconds:g} s" for share, seconds in zip(found[name], times, strict=True))
        print(f"{name:20} {told}")
    return found


if __name__ == "__main__":
    main()
