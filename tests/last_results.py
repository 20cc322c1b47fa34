"""How each test that shows a requirement to hold went when it last ran, kept in pytest's cache.

`conftest.py` records it in every run, also in one of few tests and in one spread over processes. A result
stays until its test runs again, so `make lint` reads of each test how its own last run went.
"""

from __future__ import annotations

import pytest

PASSED, SKIPPED, FAILED = "passed", "skipped", "failed"
_KEY = "iiwa-sim/requirements"
_FROM_GOOD_TO_BAD = (PASSED, SKIPPED, FAILED)


class Recorder:
    """A pytest plugin that writes down the results of the marked tests of a run."""

    def __init__(self, config: pytest.Config) -> None:
        self._config = config
        self._now: dict[str, str] = {}

    def pytest_runtest_logreport(self, report: pytest.TestReport) -> None:
        """Of a test's set-up, call and tear-down the worst counts."""
        if "requirement" in report.keywords:
            so_far = self._now.get(report.nodeid, PASSED)
            self._now[report.nodeid] = max(so_far, report.outcome, key=_FROM_GOOD_TO_BAD.index)

    def pytest_sessionfinish(self) -> None:
        if self._now and (cache := _cache_of(self._config)):
            cache.set(_KEY, {**cache.get(_KEY, {}), **self._now})


def register(config: pytest.Config) -> None:
    """Record the results of this run; with xdist in the process to which the others report."""
    if not hasattr(config, "workerinput"):
        config.pluginmanager.register(Recorder(config))


def last_results(config: pytest.Config) -> dict[str, str]:
    """Of each marked test, by node id: passed, skipped or failed. Empty before the first run."""
    cache = _cache_of(config)
    return dict(cache.get(_KEY, {})) if cache else {}


def _cache_of(config: pytest.Config) -> pytest.Cache | None:
    """None with `-p no:cacheprovider`."""
    return getattr(config, "cache", None)
