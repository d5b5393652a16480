"""What the table of one pass says of results known beforehand."""

from dataclasses import replace

from benchmarks.one_pass import BEAM, CHOICE, POLICY, RECTANGLE, TREE, _as_many, _cases, _rows
from benchmarks.search_cases import Case, Found

FOUND = Found(0.0, 0.9, 20, 0, 12, 0.5, "")


def test_row__holds_the_policy_to_each_target_by_target() -> None:
    totals = {
        RECTANGLE: {"a": 60.0, "b": 70.0, "c": 10.0},
        POLICY: {"a": 78.0, "b": 79.0, "c": 50.0},
        f"{BEAM} 8": {"a": 80.0, "b": 80.0},  # which has not solved c
        TREE: {"a": 70.0, "b": 81.0, "c": 50.0},
    }
    cases = {who: [Case(target, who, 0.3) for target in some] for who, some in totals.items()}
    results = {case: replace(FOUND, total=totals[who][case.target]) for who, some in cases.items() for case in some}
    rows = {row[1]: row for row in _rows("set", cases, results)}
    assert rows[f"{BEAM} 8"][2] == "2" and rows[f"{BEAM} 8"][-1] == "90%"  # of 30 points 27
    assert rows[f"{BEAM} 8"][-2].startswith("-1.50 ") and rows[TREE][-2].startswith("+2.00 ")
    assert rows[POLICY][3].startswith("69.0 ") and rows[POLICY][6] == "12" and not rows[POLICY][-1]


def test_tree__gets_as_many_refits_as_the_policy_took() -> None:
    cases = _cases(["a", "b"], 0.3, "quads", "w.safetensors")
    results = {case: replace(FOUND, n_refits=n) for n, case in enumerate(cases[POLICY], 7)}
    assert [(case.target, case.refits, case.faces) for case in _as_many(cases[POLICY], results)] == [
        ("a", 7, "quads"),
        ("b", 8, "quads"),
    ]
    assert {case.agent for case in cases[CHOICE + ", one pass"]} == {"choice-prior"}
