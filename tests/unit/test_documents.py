"""The generated parts of the documents are those the code gives now."""

import pytest

from tests.documents import parts as documents

DOCUMENTS = {
    "tick.md": {"tick fields"},
    "safety.md": {"transitions", "faults"},
    "protocol.md": {"fault bits", "environment numbers", "environment keys"},
    "theory.md": {"environment forces"},
    "faults.md": {"kinds of scripted faults"},
    "identify.md": {"columns of points"},
    "ladder.md": {"rungs of the ladder"},
    "api.md": {"client reference"},
    "config.md": {"rig file keys", "device option keys"},
}


@pytest.mark.parametrize("name", DOCUMENTS)
def test_every_generated_part_is_up_to_date(name, request):
    text = (request.config.rootpath / "docs" / name).read_text()
    assert documents.filled(text) == text, "run `make docs`"
    for part in DOCUMENTS[name]:
        assert f"<!-- {part} -->" in text
        assert documents.PARTS[part]() in text


def test_old_text_between_the_marks_is_replaced_and_the_rest_is_kept():
    text = "before\n<!-- faults -->\nof former times\n<!-- end faults -->\nafter\n"
    filled = documents.filled(text)
    assert "of former times" not in filled
    assert filled.startswith("before\n<!-- faults -->\n")
    assert filled.endswith("<!-- end faults -->\nafter\n")
    assert "`STALE`" in filled
    assert documents.filled(filled) == filled


def test_no_cell_of_a_table_is_broken_by_a_bar():
    for name in ("faults", "transitions"):
        rows = documents.PARTS[name]().splitlines()
        assert {row.count("|") for row in rows} == {rows[0].count("|")}


def test_a_mark_that_nobody_writes_is_refused():
    with pytest.raises(KeyError):
        documents.filled("<!-- nobody -->\n<!-- end nobody -->")
