"""Suggestions for misspelt command names."""

from collections.abc import Iterable, Iterator

LONGEST = 40
"""Longest spelling that is looked up; longer ones are no slips and would cost too much in a flood of
noise."""


class Names:
    """Finds the name that differs in one letter: wrong, missing, superfluous, or swapped with the next.
    Blanks and letter case do not count."""

    def __init__(self, names: Iterable[str]) -> None:
        # Two words that differ in one letter are equal after removing one letter from each.
        self._by_rest: dict[str, str] = {}
        for name in names:
            for rest in _rests(name.replace(" ", "")):
                self._by_rest.setdefault(rest, name)

    def nearest(self, spelling: bytes) -> str | None:
        """The name that may be meant; None if none is near."""
        if len(spelling) > LONGEST:
            return None
        written = spelling.decode("ascii", "replace").replace(" ", "").replace("\t", "").lower()
        found = (self._by_rest[rest] for rest in _rests(written) if rest in self._by_rest)
        return next(found, None)


def _rests(word: str) -> Iterator[str]:
    """The word, and all words that result from removing one letter."""
    yield word
    for place in range(len(word)):
        yield word[:place] + word[place + 1 :]
