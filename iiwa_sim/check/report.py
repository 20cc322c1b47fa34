"""The report of a check as text."""

from collections.abc import Mapping

from iiwa_sim.check.findings import Finding, Probe, Verdict
from iiwa_sim.wording import harmless, shortened

LONGEST_SEEN = 600
"""Most characters of an observation in the report."""

HEAD = "The server beside the original one, as far as that is known, and beside iiwa-sim:"


def line(probe: Probe, finding: Finding) -> str:
    """A line on one finding: what the server does, and what was expected if that differs."""
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
    """The number of deviations, and what was sent to find them."""
    count = {verdict: sum(each.verdict is verdict for each in findings) for verdict in Verdict}
    said = ", ".join(f"{harmless(name) or '(blank)'} {times}" for name, times in sorted(sent.items()))
    deviations = count[Verdict.DEVIATION]
    return (
        f"{deviations} deviation{'' if deviations == 1 else 's'}; {count[Verdict.ORIGINAL]} as the original, "
        f"{count[Verdict.OURS]} as iiwa-sim, {count[Verdict.UNTRIED]} not tried\nsent: {said}"
    )
