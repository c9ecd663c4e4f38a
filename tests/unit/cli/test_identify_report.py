"""What `rtctl identify` says of a presliding length that its ramps did not show."""

from types import SimpleNamespace

from rtctl.cli.identify_report import tell


def said(capsys, target_rad_s):
    document = {"points": [{"target_rad_s": target_rad_s}], "skipped": [], "rig": "mock"}
    tell(
        SimpleNamespace(document=document, folder="out"),
        {"points_wanted": 4, "wall_s": 1.0, "late": 0},
        (),
        complete=False,
    )
    return capsys.readouterr().out


def test_a_joint_that_hardly_bends_is_told_what_to_do_about_it(capsys):
    """A joint without bristles has no length: help that is turned over an assumed one leaves a third more."""
    text = said(capsys, 0.0)
    assert "hardly bends" in text
    assert "friction.presliding_rad" in text


def test_without_break_away_nothing_is_said_of_bending(capsys):
    text = said(capsys, 0.1)
    assert "no break-away was measured" in text
    assert "friction.presliding_rad" not in text
