# SPDX-License-Identifier: GPL-3.0-or-later
"""The page that evidence/noise makes from its rows."""

import noise_page
import noise_table
import pytest

CONDITIONS = {
    "lamp": {"title": "a lamp", "timed_as": "lamp", "samples": [64], "picked": False},
    "edge": {"title": "an edge", "timed_as": "lamp", "samples": [1024], "picked": True},
}


def row(model, form, noise, mean=1.0, error=0.001, **more):
    made = {"model": model, "values": "", "form": form, "condition": "lamp", "samples": "64"}
    made |= {"noise": str(noise), "mean": str(mean), "mean_error": str(error)}
    return made | {"apart": "", "apart_error": "", "divided_by": "exact"} | more


UNIT = row("Glossy", "node", 0.001, divided_by="node")


def page(rows, costs=()):
    return noise_page.Page([UNIT, *rows], list(costs), CONDITIONS)


def test_noise_is_in_units_of_the_node_in_the_same_scene():
    made = page([row("a", "exact", 0.002), row("b", "exact", 0.004)])
    text = made.text(seeds=4)
    assert "| `a` | 2 |" in text and "| `b` | 4 |" in text
    assert "| **median** | 3 |" in text and "| **worst** | 4 |" in text


def test_a_form_that_did_not_meet_the_lamp_is_not_called_quiet():
    made = page([row("a", "exact", 0.002), row("a", "sampled", 0.0001, mean=0.3)])
    assert made.relative("sampled", ("a", ""), ("lamp", 64)) == noise_page.MISSES_LIGHT
    assert "| `a` | unmet |" in made.text(seeds=4)


def test_noise_times_cost():
    cost = {"model": "a", "values": "", "form": "exact", "condition": "lamp", "cost": "1.5"}
    made = page([row("a", "exact", 0.002)], [cost])
    assert made.cost_weighted("exact", ("a", ""), ("lamp", 64)) == pytest.approx(3)


@pytest.mark.parametrize(
    ("mean", "error", "text"),
    [(1.02, 0.001, "**+2.0 ± 0.1**"), (1.02, 0.01, "+2.0 ± 1.0"), (1.002, 0.0001, "+0.2 ± 0.1")],
)
def test_means_that_differ_beyond_their_error_are_bold(mean, error, text):
    rows = [row("a", "exact", 0.002), row("a", "sampled", 0.1, mean=mean, error=error)]
    assert f"| `a` | {text} |" in page(rows).text(seeds=4)


def test_what_few_models_are_measured_in_has_a_table_of_its_own():
    more = {"condition": "edge", "samples": "1024", "apart": "0.03", "apart_error": "0.01"}
    rows = [row("a", "exact", 0.002, **more), row("a", "sampled", 0.1, mean=1.005, **more)]
    text = page(rows).text(seeds=4)
    assert "| `a` | sampled | 1,024 | +0.5 ± 0.1 | 3.00 | 1.00 |" in text


def test_rows_survive_and_are_replaced_by_key(tmp_path):
    file = tmp_path / "noise.csv"
    first = noise_table.Table(file, noise_table.FIELDS, noise_table.KEY)
    first.add([row("a", "exact", 1), row("b", "exact", 2)])
    second = noise_table.Table(file, noise_table.FIELDS, noise_table.KEY)
    second.add([row("a", "exact", 3)])
    assert [
        r["noise"]
        for r in noise_table.Table(file, noise_table.FIELDS, noise_table.KEY).rows.values()
    ] == [
        "3",
        "2",
    ]


def test_the_best_form_has_the_least_noise_times_cost():
    rows = [row("a", "exact", 0.002), row("a", "aimed", 0.001), row("b", "exact", 0.002)]
    costs = {("a", "exact"): 1.0, ("a", "aimed"): 3.0, ("b", "exact"): 1.0}
    made = noise_page.Page([UNIT, *rows], [], CONDITIONS, costs)
    best = dict(made.best_forms(("lamp", 64)))
    assert best == {"exact": 1}, "of b only one form is known, and 3 x 0.001 is more than 0.002"
    assert "| exact | 1 |" in made.text(seeds=4)
