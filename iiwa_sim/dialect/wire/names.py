"""Names of commands that were meant, by names that were written."""

from collections.abc import Iterable, Iterator

LONGEST = 40
"""A longer spelling is no slip of the finger; to look for it would cost too much in a flood of rubbish."""


class Names:
    """Finds a name that differs in one letter: wrong, missing, too many, or swapped with the next; blanks and
    letter case do not count."""

    def __init__(self, names: Iterable[str]) -> None:
        # Two words that differ in one letter have in common what is left when one letter goes from each.
        self._by_rest: dict[str, str] = {}
        for name in names:
            for rest in _rests(name.replace(" ", "")):
                self._by_rest.setdefault(rest, name)

    def nearest(self, spelling: bytes) -> str | None:
        """The name meant, None where there is none so near."""
        if len(spelling) > LONGEST:
            return None
        written = spelling.decode("ascii", "replace").replace(" ", "").replace("\t", "").lower()
        found = (self._by_rest[rest] for rest in _rests(written) if rest in self._by_rest)
        return next(found, None)


def _rests(word: str) -> Iterator[str]:
    """The word, and what is left of it without one of its letters."""
    yield word
    for place in range(len(word)):
        yield word[:place] + word[place + 1 :]
