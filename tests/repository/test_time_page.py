# SPDX-License-Identifier: GPL-3.0-or-later
"""The page of error against run time."""

import math

import pytest
import time_page


def row(model, form, noise, condition="lamp", mean=1.0, **more):
    made = {"model": model, "values": "", "form": form, "condition": condition, "samples": "64"}
    made |= {"noise": str(noise), "mean": str(mean), "mean_error": "0.001", "apart": ""}
    return made | {"divided_by": "node" if form == "node" else "exact"} | more


def test_time_is_noise_times_cost_in_units_of_the_node():
    rows = [
        row("Glossy", "node", 0.001),
        row("Diffuse", "node", 0.0005),
        row("a", "exact", 0.002),
        row("a", "sampled", 0.0001, mean=0.3),
        row("a", "exact", 7, condition="no node here"),
    ]
    costs = [{"model": "a", "form": "exact", "cost": "1.5"}]
    costs += [{"model": "a", "form": "sampled", "cost": "1"}]
    names, found, diffuse = time_page.times(rows, costs)
    assert names == ["lamp"]
    assert found["exact"]["lamp"] == [pytest.approx(3)]
    assert found["sampled"]["lamp"] == [math.inf], "it did not meet the lamp"
    assert diffuse["lamp"] == pytest.approx(0.5)


def test_rows_of_forms():
    text = """Above.

| Model | exact | fitted |
|---|---|---|
| `a` | 3, 0, 1.34 | 9, 0.43 %, 1.76 |
| `b` | - | 8, 2 %, ? |
"""
    rows = [("a", "exact", 0, 1.34), ("a", "fitted", pytest.approx(0.0043), 1.76)]
    assert time_page.forms_table(text) == rows
