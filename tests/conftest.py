# SPDX-License-Identifier: GPL-3.0-or-later
"""An option of all tests, and their environment."""

import os
import zlib

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


@pytest.fixture(scope="session")
def third_of(request):
    """third_of(cases): with --third a third of the cases, another at each commit; without it, and
    in evidence/run, all. For cases that are measured together; those that are separate tests are
    marked `long`."""
    text = request.config.getoption("third")
    if EVERY_CASE or text is None:
        return list
    # Apart from the choice among tests: each part of such a test has its turn.
    return lambda cases: third(list(cases), f"{text} cases")


def pytest_addoption(parser):
    parser.addoption(
        "--few",
        type=int,
        metavar="N",
        help="of each test with more cases than N take N: the first, the last, and between them",
    )
    parser.addoption(
        "--third",
        metavar="TEXT",
        help="of the tests marked `long`, the cases of each marked `many`, and the groups marked "
        "`together`, run a third, which TEXT chooses, a commit for example",
    )
    parser.addoption(
        "--part",
        metavar="I/N",
        help="run the I-th of N parts of the files, from 1",
    )
    parser.addoption(
        "--third-of-files",
        metavar="TEXT",
        help="run a third of the files, which TEXT chooses",
    )


def third(things, text):
    """Every third thing, beginning with one of the first three, which the text chooses. If there
    are fewer, one."""
    return things[zlib.crc32(text.encode()) % max(min(3, len(things)), 1) :: 3]


# After -m has deselected by marks, so that this many remain.
@pytest.hookimpl(trylast=True)
def pytest_collection_modifyitems(config, items):
    few = config.getoption("few")
    if few is not None and few < 2:
        raise pytest.UsageError(f"--few: expected 2 or more, got {few}")
    tests = {}
    for item in items:
        tests.setdefault(item.nodeid.split("[")[0], []).append(item)
    kept, text = set(), config.getoption("third")
    for cases in tests.values():
        limits = [len(cases), *([few] if few is not None else [])]
        if not EVERY_CASE:
            limits += [mark.args[0] for mark in cases[0].iter_markers("sample")]
        chosen = evenly(cases, min(limits))
        if text is not None and cases[0].get_closest_marker("many"):
            chosen = third(chosen, text)
        kept |= set(chosen)
    if text is not None:
        # A few groups, of which each is chosen apart from others.
        kept -= {
            item
            for item in kept
            for mark in item.iter_markers("together")
            if zlib.crc32(f"{text} {mark.args[0]}".encode()) % 3
        }
        long = [item for item in items if item in kept and item.get_closest_marker("long")]
        kept -= set(long) - set(third(long, text))
    if (part := config.getoption("part")) is not None:
        index, count = map(int, part.split("/"))
        files = sorted({item.path for item in items})[index - 1 :: count]
        kept -= {item for item in kept if item.path not in files}
    if (text := config.getoption("third_of_files")) is not None:
        files = sorted({item.path for item in items})
        kept = {item for item in kept if item.path in set(third(files, text))}
    config.hook.pytest_deselected(items=[item for item in items if item not in kept])
    items[:] = [item for item in items if item in kept]
