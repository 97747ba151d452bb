# SPDX-License-Identifier: GPL-3.0-or-later
"""An option of all tests, and their environment."""

import os

import pytest

# Each run computes results anew, whatever earlier ones left in the user's cache.
os.environ["BRDFC_CACHE"] = ""
#: evidence/run runs every case of the tests that are marked `sample`.
EVERY_CASE = os.environ.get("BRDFC_EVIDENCE") == "all"


def evenly(cases, count):
    return [cases[i * (len(cases) - 1) // max(count - 1, 1)] for i in range(count)]


def few_of(cases, count):
    """This many of a test's cases, chosen evenly and including the first and the last;
    evidence/run runs all. For cases that are rendered in one picture; cases that are separate
    tests are marked `sample`."""
    cases = list(cases)
    return cases if EVERY_CASE else evenly(cases, min(count, len(cases)))


@pytest.fixture(scope="session", name="few_of")
def few_of_fixture():
    return few_of


def pytest_addoption(parser):
    parser.addoption(
        "--few",
        type=int,
        metavar="N",
        help="of each test with more cases than N take N: the first, the last, and between them",
    )


# After -m has deselected by marks, so that this many remain.
@pytest.hookimpl(trylast=True)
def pytest_collection_modifyitems(config, items):
    few = config.getoption("few")
    if few is not None and few < 2:
        raise pytest.UsageError(f"--few: expected 2 or more, got {few}")
    tests = {}
    for item in items:
        tests.setdefault(item.nodeid.split("[")[0], []).append(item)
    kept = set()
    for cases in tests.values():
        limits = [len(cases), *([few] if few is not None else [])]
        if not EVERY_CASE:
            limits += [mark.args[0] for mark in cases[0].iter_markers("sample")]
        kept |= set(evenly(cases, min(limits)))
    config.hook.pytest_deselected(items=[item for item in items if item not in kept])
    items[:] = [item for item in items if item in kept]
