"""The reference of all keys is up to date and says something about each of them."""

import re

from tests.configuration.reference_page import PAGE, page


def test_the_page_is_up_to_date():
    assert PAGE.read_text(encoding="utf-8") == page(), "run python -m tests.configuration.reference_page"


def test_every_key_has_a_meaning_beside_its_unit():
    rows = [row for row in page().splitlines() if row.startswith("| `")]
    assert len(rows) > 300
    silent = [row for row in rows if not re.search(r"\w{3}", re.sub(r"\[[^\]]*\]", "", row.rsplit(" | ", 1)[1]))]
    assert not silent


def test_keys_of_both_are_told_once():
    run, walk = page().split("## A walk")
    run = run.split("## A run with a rival")[0]
    assert "### stages.tracking.mpc.ocp.foothold_barrier" in run
    assert "### stages.tracking.mpc.ocp.foothold_barrier" not in walk
    assert "### stages.velocity_reference" in walk and "### changes[i]" in walk
