"""`iiwa-sim --view-port` and `iiwa-sim show`: unusable options."""

from __future__ import annotations

from collections.abc import Sequence

import pytest

from tests.processes import refused


@pytest.mark.parametrize(
    ("options", "reason"),
    [
        (["--view-host", "::1"], "--view-host: expected --view-port with it"),
        (["--view-port", "0", "--view-host", "0.0.0.0"], "--view-token or --view-token-file with it"),
        (["show", "run.mcap", "--host", "0.0.0.0"], "--host: no such option"),
    ],
)
def test_unusable_options_are_reported_in_one_line(options: Sequence[str], reason: str) -> None:
    assert reason in refused(*options)
