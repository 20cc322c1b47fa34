"""A check in words."""

from collections.abc import Mapping

from iiwa_sim.check.findings import Finding, Probe, Verdict
from iiwa_sim.wording import harmless, shortened

LONGEST_SEEN = 600
"""Characters of what was seen; a server may say much."""

HEAD = "The server beside the original one, as far as that is known, and beside iiwa-sim:"


def line(probe: Probe, finding: Finding) -> str:
    """One line on one finding: how it is, what was expected where it is otherwise."""
    told = f"{finding.verdict.value:15}  {probe.event}"
    seen = shortened(harmless(finding.seen), LONGEST_SEEN)
    match finding.verdict:
        case Verdict.ORIGINAL:
            told += f": {probe.original}" if probe.original else ""
        case Verdict.OURS:
            told += f": {probe.ours}; the original: {probe.original}"
        case Verdict.DEVIATION:
            other = f" (the original: {probe.original}" if probe.original else ""
            other += f"; iiwa-sim: {probe.ours}" if probe.ours else ""
            return f"{told}: {seen}{other}{')' if other else ''}"
    return f"{told} ({seen})" if seen else told


def summary(findings: list[Finding], sent: Mapping[str, int]) -> str:
    """How many deviations there are, and what was sent to find that out."""
    count = {verdict: sum(each.verdict is verdict for each in findings) for verdict in Verdict}
    said = ", ".join(f"{harmless(name) or '(blank)'} {times}" for name, times in sorted(sent.items()))
    deviations = count[Verdict.DEVIATION]
    return (
        f"{deviations} deviation{'' if deviations == 1 else 's'}; {count[Verdict.ORIGINAL]} as the original, "
        f"{count[Verdict.OURS]} as iiwa-sim, {count[Verdict.UNTRIED]} not tried\nsent: {said}"
    )
